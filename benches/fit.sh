#!/usr/bin/env bash
# One fit of a minute of two angles at 30 Hz: `freeswing` against scipy's solve_ivp and least_squares, from the same start values, in turn.
# scipy needs a start close by, or it never arrives: the file's coefficients are 0.2 % off the simulated ones.
#
#   benches/fit.sh [ROUNDS]        3 by default; needs Python 3.11 with numpy and scipy (PYTHON=... to name one)
set -euo pipefail
cd "$(dirname "$0")/.."

rounds=${1:-3}
python=${PYTHON:-python3}
mkdir -p "${CARGO_TARGET_DIR:-target}/bench-fit"
data=$(realpath "${CARGO_TARGET_DIR:-target}/bench-fit")
cargo build --release --quiet

# K, C, hinge damper
experiment() {
    cat <<TOML
[specimen]
mass_kg = 0.3606e-3
length_m = 0.20
width_m = 0.05
link_lengths_m = [0.10, 0.10]
[model]
k_eq_n_m_per_rad = $1
c_eq_n_m_s_per_rad = $2
release_rad = [0.5, 0.62]
[model.effects]
hinge_viscous = $3
TOML
}
experiment 2.0e-4 2.0e-6 1.0e-7 >"$data/truth.toml"
experiment 2.004e-4 2.004e-6 1.002e-7 >"$data/start.toml"
"${CARGO_TARGET_DIR:-target}/release/freeswing" simulate --config "$data/truth.toml" --out "$data/angles.csv" \
    --duration 60 --rate 30 --noise-rad 1.7e-3

for ((round = 1; round <= rounds; round++)); do
    own=$(cargo bench --quiet --bench fit -- "$data/angles.csv" "$data/start.toml")
    theirs=$("$python" benches/scipy_fit.py "$data/angles.csv" --config "$data/start.toml")
    "$python" - "$own" "$theirs" <<'PYTHON'
import json, sys
own, theirs = (json.loads(line) for line in sys.argv[1:])
seconds = theirs["seconds"]
print(f"freeswing {own['seconds']:.3f} s, scipy {seconds:.2f} s: {seconds / own['seconds']:.0f} times")
PYTHON
done
