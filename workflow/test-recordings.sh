#!/bin/sh
# A small folder of recordings as a laboratory has it, for test-cluster.sh: tables, videos, and three bad ones among them.
#
#     FREESWING=… workflow/test-recordings.sh FOLDER
set -eu
folder=$1
mkdir -p "$folder/monday" "$folder/tuesday 2"

specimen='[specimen]
name = "strip"
mass_kg = 0.3606e-3
length_m = 0.20
width_m = 0.05
link_lengths_m = [0.10, 0.10]

[rig]
gravity_m_s2 = 9.80665
'
# as the recordings are made, and what an experimenter knows of them
made() {
    printf '%s\n[model]\nk_eq_n_m_per_rad = 1.5e-4\nc_eq_n_m_s_per_rad = 2e-6\nrelease_rad = [%s]\n' "$specimen" "$1"
    printf '[render]\nwidth_px = 320\nheight_px = 240\nscale_px_per_m = 800.0\nhinge_px = [160.0, 40.0]\nmark_diameter_px = 12.0\nstrip_width_px = 22.0\n'
}
printf '%s\n[model]\nk_eq_n_m_per_rad = 2e-4\nc_eq_n_m_s_per_rad = 1e-6\n' "$specimen" >"$folder/experiment.toml"

config=$(mktemp)
trap 'rm -f "$config"' EXIT
for k in 1 2 3 4 5 6 7; do
    made "0.1$k, 0.2$k" >"$config"
    "$FREESWING" simulate --config "$config" --duration 40 --rate 60 --noise-rad 2e-4 --seed "$k" --out "$folder/monday/swing$k.csv" >/dev/null
done
for k in 1 2 3 4 5; do
    made "0.2$k, 0.3$k" >"$config"
    "$FREESWING" render --config "$config" --frames 300 --seed "$k" --quiet --out "$folder/tuesday 2/film$k.mp4" >/dev/null
done

# a film that was cut off, an experiment file with a wrong word, a table without an end
head -c 20000 "$folder/tuesday 2/film1.mp4" >"$folder/tuesday 2/cut.mp4"
cp "$folder/tuesday 2/film2.mp4" "$folder/tuesday 2/wrong.mp4"
printf '[rig]\npivot = [1.0, 2.0]\n' >"$folder/tuesday 2/wrong.toml"
printf 't_s,theta1_rad\n0,0.1\n' >"$folder/monday/short.csv"
