#!/bin/sh
# A folder of 200 short recordings, 20 of them bad, through `freeswing batch`: rows, reasons, throughput against ffmpeg's decoding alone, memory, kills, the page.
#   benches/folder.sh [FOLDER]      FOLDER holds the recordings and results; target/folder otherwise
set -eu
cd "$(dirname "$0")/.."
folder=${1:-target/folder}
target=${CARGO_TARGET_DIR:-target}
freeswing=$target/release/freeswing
[ -x "$freeswing" ] || cargo build --release
mkdir -p "$folder/in"

# ten swings of five seconds at 720p, each eighteen times; four kinds of bad ones
for k in 0 1 2 3 4 5 6 7 8 9; do
    [ -f "$folder/$k.mp4" ] || {
        sed "s/^release_rad.*/release_rad = [0.3$k, 0.4$k]/" videos/kapton.toml >"$folder/render.toml"
        "$freeswing" render --quiet --config "$folder/render.toml" --duration 5 --seed "$k" --out "$folder/$k.mp4"
    }
    for copy in 01 02 03 04 05 06 07 08 09 10 11 12 13 14 15 16 17 18; do
        mkdir -p "$folder/in/day$copy"
        ln -f "$folder/$k.mp4" "$folder/in/day$copy/swing$k.mp4"
    done
done
cp videos/kapton.base.toml "$folder/in/experiment.toml"
mkdir -p "$folder/in/bad"
for k in 1 2 3 4 5; do
    head -c 20000 "$folder/$k.mp4" >"$folder/in/bad/cut$k.mp4"
    echo 'no film' >"$folder/in/bad/text$k.avi"
    ln -f "$folder/$k.mp4" "$folder/in/bad/config$k.mp4"
    printf '[rig]\npivot = [1.0, %s.0]\n' "$k" >"$folder/in/bad/config$k.toml"
    ffmpeg -y -loglevel error -f lavfi -i "color=gray:s=640x360:d=1:r=30" "$folder/in/bad/empty$k.mp4"
done

seconds() { date +%s.%N; }
rm -rf "$folder/out"
start=$(seconds)
"$freeswing" batch "$folder/in" --out "$folder/out" --until track --no-overlay --quiet &
batch=$!
: >"$folder/memory"
while kill -0 "$batch" 2>/dev/null; do
    # of the batch and its runs, kB
    ps -o rss= --pid "$batch" --ppid "$batch" | awk '{ sum += $1 } END { print sum }' >>"$folder/memory"
    sleep 0.5
done
wait "$batch" || [ $? -eq 1 ]
end=$(seconds)
decode_start=$(seconds)
find "$folder/in" -name 'swing*.mp4' -o -name 'config*.mp4' -o -name 'empty*.mp4' | while read -r film; do
    ffmpeg -nostdin -loglevel error -i "$film" -f null - </dev/null
done
decode_end=$(seconds)
awk -v a="$start" -v b="$end" -v c="$decode_start" -v d="$decode_end" 'BEGIN {
    printf "batch, track alone: %.1f s; ffmpeg, decoding alone: %.1f s; throughput %.2f of it\n", b - a, d - c, (d - c) / (b - a) }'
awk '{ v[NR] = $1 } END { n = NR; for (i = int(n / 5) + 1; i <= n * 9 / 10; i++) { s += v[i]; c++; if (v[i] > m) m = v[i] }
    for (i = int(n / 5) + 1; i <= n / 2; i++) { f += v[i]; p++ } for (i = int(n / 2) + 1; i <= n * 9 / 10; i++) { l += v[i]; q++ }
    printf "memory: %.0f MB on average, %.0f MB at most, second half over first %.2f\n", s / c / 1024, m / 1024, (l / q) / (f / p) }' "$folder/memory"
cut -d, -f2 "$folder/out/summary.csv" | sort | uniq -c
grep failed "$folder/out/summary.csv" | cut -d, -f1,3 | head -20
