# What a person may want from this folder. `make` alone lists it.

TRACK = cargo run --release --quiet --bin track --

help:
	@echo 'make demo      track videos/kapton.mp4 into demo/'
	@echo 'make test      every test'
	@echo 'make accuracy  the slow accuracy tests, optimised'
	@echo 'make concealed find hidden effects in recordings made by another program, and score it'
	@echo 'make test-cluster  a Slurm of two nodes on this machine: every way to share a folder out, one node killed, against batch'
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

test:
	@scripts/setup tests
	cargo test

accuracy: setup
	cargo test --release --no-fail-fast --test accuracy --test foreign --test identify --test fit --test laser --test diagnose_command -- --include-ignored --nocapture

# Cases that are there are not made again, nor diagnosed again; `rm -r target/concealed/*/results` for a new build.
BANKS = ode strip video
# Debian's packages are for its own Python, which need not be the first on the path.
PYTHON = OMP_NUM_THREADS=1 $(shell python3 -c 'import numpy, scipy' 2>/dev/null && echo python3 || echo /usr/bin/python3)
FREESWING = $${CARGO_TARGET_DIR:-target}/release/freeswing

concealed: $(BANKS:%=target/concealed/%/labels.json)
	cargo build --release
	@for bank in $(BANKS); do \
	    FREESWING=$(FREESWING) fixtures/concealed/run.sh target/concealed/$$bank target/concealed/$$bank/results; \
	    $(PYTHON) fixtures/concealed/score.py target/concealed/$$bank target/concealed/$$bank/results; \
	done
	@$(PYTHON) fixtures/concealed/baselines.py target/concealed/ode

target/concealed/ode/labels.json: what = --cases 200
target/concealed/strip/labels.json: what = --cases 24 --levels strip
target/concealed/video/labels.json: what = --cases 8 --levels video
target/concealed/%/labels.json: | setup-concealed
	$(PYTHON) fixtures/concealed/generate.py --bank test --out $(@D) $(what)

setup-concealed:
	@scripts/setup concealed

test-cluster:
	@scripts/setup cluster
	cargo build --release
	FREESWING=$(FREESWING) workflow/test-cluster.sh $${CARGO_TARGET_DIR:-target}/cluster

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

.PHONY: help setup setup-concealed demo test accuracy concealed test-cluster bench lint clean
