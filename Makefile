# What a person may want from this folder. `make` alone lists it.

TRACK = cargo run --release --quiet --bin track --

help:
	@echo 'make demo      track videos/kapton.mp4 into demo/'
	@echo 'make test      every test'
	@echo 'make accuracy  the slow accuracy tests, optimised'
	@echo 'make bench     each stage, then the whole against ffmpeg and OpenCV'
	@echo 'make lint      formatting, clippy, documentation; no warning passes'
	@echo 'make clean     remove what was built or made'

setup:
	@scripts/setup

demo: setup
	cargo build --release
	@mkdir -p demo
	$(TRACK) videos/kapton.mp4 --out demo/angles.csv --overlay demo/overlay.mp4
	@echo
	@echo 'From a synthetic recording of a swinging Kapton strip, 25 s:'
	@echo '  demo/angles.csv   time, three marks in pixels, two angles with their standard deviations'
	@echo '  demo/overlay.mp4  the recording with all of it drawn in'
	@echo '  demo/angles.json  where they come from: source, options, time stamps, noise, warnings'

test: setup
	cargo test

accuracy: setup
	cargo test --release --test accuracy --test identify --test fit -- --include-ignored --nocapture

bench: setup
	cargo bench
	benches/paired.sh

lint: setup
	cargo fmt --check
	cargo clippy --all-targets -- -D warnings
	RUSTDOCFLAGS='-D warnings' cargo doc --no-deps

clean:
	cargo clean
	rm -rf demo

.PHONY: help setup demo test accuracy bench lint clean
