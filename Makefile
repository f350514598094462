# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
#
# The front door: every target does its own set-up, says what it does, and is quick when nothing has to be done.

.DEFAULT_GOAL := help
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.ONESHELL:
MAKEFLAGS += --no-print-directory
JOBS ?= $(shell nproc)
PREFIX ?= /usr/local
# Lets the compiler cache serve every checkout on this machine.
export CCACHE_BASEDIR := $(CURDIR)
export CCACHE_NOHASHDIR := 1
DEMO_FRAMES ?= 300

photoslam := build/release/photoslam
room := .cache/room-$(DEMO_FRAMES)
room_sources := $(shell find src/sources/synthetic apps/photoslam/synth.cpp -name '*.h' -o -name '*.cpp' 2>/dev/null | grep -v _test)
say = @printf '\033[1m== %s\033[0m\n' "$(1)"

.PHONY: help demo test build install lint format asan tsan docs clean

help: ## Print this list
	@grep -hE '^[a-z ]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z ]+):.*## /  make \1\t/; s/asan tsan/asan, tsan/' | expand -t 20

demo: build $(room)/groundtruth.txt ## Run the whole system on the built-in room sequence: results in output/demo
	$(call say,SLAM at real-time pace on $(room), then 30 s of refinement -> output/demo)
	@$(photoslam) run $(room) --output output/demo --refine-seconds 30
	echo "Look at output/demo/report.html; output/demo/map.ply opens in every gaussian-splat viewer."

# Ray-traced once; anew when the code that makes it has changed.
$(room)/groundtruth.txt: $(room_sources) | build
	$(call say,Synthetic room: $(DEMO_FRAMES) frames 640x480 -> $(room) (one to two minutes, then cached))
	@rm -rf $(room)
	$(photoslam) synth room --frames $(DEMO_FRAMES) --output $(room)
	touch $@

build: ## Install what is missing and build the release binary build/release/photoslam
	@scripts/install_dependencies.sh build
	[ -f build/release/build.ninja ] || scripts/configure.sh release -DPHOTOSLAM_BUILD_TESTS=OFF -DPHOTOSLAM_BUILD_BENCHMARKS=OFF
	$(call say,Building $(photoslam))
	@ninja -C build/release -j $(JOBS) photoslam modules

test: ## Install what is missing, build everything and run all tests
	@scripts/install_dependencies.sh build test
	scripts/configure.sh release -DPHOTOSLAM_BUILD_TESTS=ON -DPHOTOSLAM_BUILD_BENCHMARKS=ON
	$(call say,Building the program, its tests and benchmarks)
	@ninja -C build/release -j $(JOBS)
	$(call say,Running the tests)
	@ctest --test-dir build/release --output-on-failure --progress -j $(JOBS)

install: build ## Install the program and the library into PREFIX (default /usr/local)
	$(call say,Installing into $(PREFIX))
	@ninja -C build/release -j $(JOBS) photoslam_shared
	cmake --install build/release --prefix $(PREFIX)

lint: ## Check layers, sizes, formatting, and run clang-tidy on everything
	@scripts/install_dependencies.sh build test lint
	scripts/check_layers.py
	scripts/check_sizes.py
	scripts/check_format.sh
	scripts/configure.sh release -DPHOTOSLAM_BUILD_TESTS=ON -DPHOTOSLAM_BUILD_BENCHMARKS=ON
	scripts/check_tidy.py --jobs $(JOBS)

format: ## Format all C++ sources
	@scripts/install_dependencies.sh lint
	git ls-files --cached --others --exclude-standard '*.h' '*.cpp' '*.cu' '*.cuh' | xargs clang-format-19 -i

asan tsan: ## Build, then run the tests with the address and undefined-behaviour, or the thread sanitizer
	@scripts/install_dependencies.sh build test
	scripts/configure.sh $@
	ninja -C build/$@ -j $(JOBS)
	ctest --test-dir build/$@ --output-on-failure --progress -j $(JOBS)

docs: build ## Regenerate docs/configuration.md and docs/licences.md from the program
	@$(photoslam) config --manual > docs/configuration.md
	scripts/list_licences.py $(photoslam) > docs/licences.md

clean: ## Remove build folders, results and cached sequences
	@rm -rf build output .cache
