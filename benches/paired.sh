#!/usr/bin/env bash
# Wall time of `track` against `ffmpeg -f null` and a plain OpenCV pipeline, on the same 60 s clips of 0.2, 2 and 20
# Mbit/s, run in turn so that each round meets the same machine; then the memory of `track` on a minute and on half an hour.
#
#   benches/paired.sh [ROUNDS]        5 by default; clips stay in target/bench-videos
set -euo pipefail
cd "$(dirname "$0")/.."

rounds=${1:-5}
target=${CARGO_TARGET_DIR:-target}
clips=$target/bench-videos
mkdir -p "$clips"

cargo build --release --quiet
pipeline=$clips/opencv_pipeline
if [ benches/opencv_pipeline.cpp -nt "$pipeline" ]; then
    # only the three libraries it uses: OpenCV's full list would cost its start-up dearly
    g++ -O2 benches/opencv_pipeline.cpp -o "$pipeline" $(pkg-config --cflags opencv4) \
        -lopencv_videoio -lopencv_imgproc -lopencv_core
fi

# name width height pixels-a-metre hinge-x hinge-y mark strip
render() {
    local clip=$clips/$1.mp4
    [ -s "$clip" ] && return
    echo "rendering $clip (once)"
    cat >"$clips/$1.toml" <<TOML
[specimen]
mass_kg = 0.3606e-3
length_m = 0.20
width_m = 0.05
link_lengths_m = [0.10, 0.10]

[render]
duration_s = 60.0
width_px = $2
height_px = $3
scale_px_per_m = $4
hinge_px = [$5, $6]
mark_diameter_px = $7
strip_width_px = $8
TOML
    "$target/release/freeswing" render --config "$clips/$1.toml" --out "$clip"
}
render 720p 1280 720 2600 640 96 22 48
render 1080p 1920 1080 3900 960 144 33 72

# The same as cameras and programs write them, from 0.2 to 20 Mbit/s; a camera's noise takes up the higher rates.
encode() {
    local clip=$clips/$1-$2M.mp4
    [ -s "$clip" ] && return
    echo "encoding $clip (once)"
    ffmpeg -v error -y -i "$clips/$1.mp4" -vf "noise=alls=$3:allf=t" -c:v libx264 -preset medium -pix_fmt yuv420p \
        -b:v "$2M" -maxrate "$2M" -bufsize "$2M" "$clips/part.mp4"
    mv "$clips/part.mp4" "$clip"
}
names=()
for size in 720p 1080p; do
    encode $size 0.2 0
    encode $size 2 2
    encode $size 20 12
    names+=("$size-0.2M" "$size-2M" "$size-20M")
done

# Wall seconds and processor seconds of one run.
seconds() {
    local TIMEFORMAT='%R %U %S'
    { time "$@" >/dev/null 2>&1; } 2>&1 | awk '{ print $1, $2 + $3 }'
}
run_track() { seconds "$target/release/track" "$1" --out "$clips/angles.csv" --quiet; }
run_ffmpeg() { seconds ffmpeg -v error -i "$1" -f null -; }
run_opencv() { seconds "$pipeline" "$1"; }
# The median of an expression over the rounds; $1 $2 track, $3 $4 ffmpeg, $5 $6 opencv.
median() {
    awk "{ print $1 }" "$table" | sort -n |
        awk '{ v[NR] = $1 } END { print (v[int((NR + 1) / 2)] + v[int(NR / 2) + 1]) / 2 }'
}

echo "$(nproc) cores, load $(cut -d ' ' -f 1 /proc/loadavg), $(ffmpeg -version | awk 'NR == 1 { print $1, $3 }'), OpenCV $(pkg-config --modversion opencv4)"
echo "medians of $rounds rounds after a warm-up; the ratios are medians of each round's own"
printf '%-16s %9s %9s %9s %14s %14s\n' clip track ffmpeg opencv track/ffmpeg track/opencv
row() { printf '%-16s %7.2f s %7.2f s %7.2f s %14.3f %14.3f\n' "$@"; }
for name in "${names[@]}"; do
    clip=$clips/$name.mp4
    table=$clips/$name.times
    for what in track ffmpeg opencv; do "run_$what" "$clip" >/dev/null; done
    for ((round = 0; round < rounds; round++)); do
        echo "$(run_track "$clip") $(run_ffmpeg "$clip") $(run_opencv "$clip")"
    done >"$table"
    row "$name, wall" "$(median '$1')" "$(median '$3')" "$(median '$5')" "$(median '$1 / $3')" "$(median '$1 / $5')"
    row "$name, processor" "$(median '$2')" "$(median '$4')" "$(median '$6')" "$(median '$2 / $4')" "$(median '$2 / $6')"
done

# Peak resident memory in MB, from the kernel's own account while the program runs.
peak_mb() {
    "$target/release/track" "$1" --out "$clips/angles.csv" --quiet &
    local peak=0 now
    while now=$(awk '/VmHWM/ { print $2 }' "/proc/$!/status" 2>/dev/null) && [ -n "$now" ]; do
        peak=$now
        sleep 0.02
    done
    wait $!
    awk -v kb="$peak" 'BEGIN { printf "%.0f", kb / 1024 }'
}
long=$clips/1080p-30min.mp4
[ -s "$long" ] || ffmpeg -v error -stream_loop 29 -i "$clips/1080p.mp4" -c copy "$long"
echo "peak resident memory of track at 1080p: $(peak_mb "$clips/1080p.mp4") MB for 1 minute, $(peak_mb "$long") MB for 30"
