# SPDX-License-Identifier: Apache-2.0
# Entry points. `make demo` and `make test` work on a bare Debian: they install what is missing, build and run.
#
#   make setup            install missing packages (needs root or sudo only if something is missing)
#   make build            build/release/covary
#   make demo             render a small scene by path tracing, Open Image Denoise and covary into out/
#   make test             build and run all tests except nightly ones        TESTS=regex selects some
#   make check            lint every file, run the tests under sanitizers and with Clang and the standard library's
#                         assertions, run each fuzz target for a minute (FUZZ=seconds); takes hours
#   make bench            build and run the micro benchmarks: time of each stage, and the fraction of its limit that it
#                         reaches; build/release/bench.json            BENCH=regex selects some; BASELINE=FILE compares
#                         with an earlier bench.json; HISTORY=benchmarks/results.md adds a row to that table
#   make lint             formatting, static analysis, rules of the tree    ALL=1 analyses all files, not only changes
#   make install          build for every x86-64 processor (docs/library.md) and install under PREFIX (default
#                         /usr/local), with Open Image Denoise from PyPI (scripts/oidn) unless OIDN=OFF; ARCH=native
#                         builds only for machines like this one, in a third of the time
#   make deb              Debian package of what `make install` installs, in dist/
#   make docs             the documentation as a site, build/site/index.html (Sphinx, from PyPI)
#   make wheel            the Python package as a wheel for every x86-64 processor, and its source distribution, in
#                         dist/ (docs/python.md); ARCH=native: only for machines like this one
#   make blender          the Blender add-on, dist/covary-blender.zip; includes the program if dist/ has a wheel
#   make asan|tsan        build and test under the address, leak and undefined-behaviour sanitizers; thread sanitizer
#   make dev|clang        build and test with the standard library's assertions, by GCC or by Clang
#   make clean            remove build/ and out/
#
# ARCH=x86-64-v3 builds for every AVX2 machine instead of this one. WERROR=ON makes warnings errors until WERROR=OFF
# (dev and clang always do), so that the targets above share one build. JOBS=n limits parallelism (default: number of
# processors, fewer if memory is short).

ARCH   ?= native
PREFIX ?= /usr/local
JOBS   ?= $(shell scripts/jobs)
TESTS  ?= .
BENCH  ?= .
FUZZ   ?= 60
CTEST   = ctest --output-on-failure --no-tests=error -LE nightly -R '$(TESTS)' -j $(JOBS)
WARNINGS = $(if $(WERROR),-DCOVARY_WERROR=$(WERROR))
CONFIGURE = -DCOVARY_ARCH=$(ARCH) $(WARNINGS)

# Install for every processor unless ARCH was given.
INSTALL = $(if $(filter file,$(origin ARCH)),portable,release)

.PHONY: all setup configure build demo test check nightly bench lint install deb docs wheel blender dev clang asan tsan
.PHONY: clean
all: build

setup:
	@scripts/setup

configure: setup
	@cmake --preset release $(CONFIGURE) > /dev/null

build: configure
	@cmake --build build/release -j $(JOBS) --target covary

demo: build
	@scripts/oidn build/oidn || echo "demo: without Open Image Denoise, which PyPI has"
	@COVARY_OIDN=$${COVARY_OIDN-$$([ ! -d build/oidn ] || echo build/oidn)} scripts/demo build/release/covary out

test: configure
	@cmake --build build/release -j $(JOBS)
	@cd build/release && $(CTEST)

check:
	@scripts/setup check
	@$(MAKE) --no-print-directory lint ALL=1
	@for build in asan tsan clang; do $(MAKE) --no-print-directory $$build || exit 1; done
	@scripts/fuzz $(FUZZ)

nightly: configure
	@cmake --build build/release -j $(JOBS)
	@cd build/release && ctest --output-on-failure -j $(JOBS)

bench: configure
	@cmake --build build/release -j $(JOBS)
	@scripts/bench build/release '$(BENCH)' '$(BASELINE)' '$(HISTORY)'

lint:
	@scripts/setup lint
	@cmake --preset release $(CONFIGURE) > /dev/null
	@scripts/lint build/release $(if $(ALL),--all)

install: setup
	@cmake --preset $(INSTALL) $(if $(filter release,$(INSTALL)),-DCOVARY_ARCH=$(ARCH)) $(WARNINGS) > /dev/null
	@cmake --build build/$(INSTALL) -j $(JOBS) --target covary
	@cmake --install build/$(INSTALL) --prefix $(PREFIX)
	@[ "$(OIDN)" = OFF ] || scripts/oidn $(PREFIX) || echo "install: without Open Image Denoise; scripts/oidn $(PREFIX)"

deb: setup
	@cmake --preset $(INSTALL) $(if $(filter release,$(INSTALL)),-DCOVARY_ARCH=$(ARCH)) $(WARNINGS) > /dev/null
	@cmake --build build/$(INSTALL) -j $(JOBS) --target covary
	@cd build/$(INSTALL) && cpack -G DEB -B $(CURDIR)/dist

docs:
	@scripts/docs build/site

wheel: setup
	@WERROR=$(WERROR) JOBS=$(JOBS) scripts/wheel $(if $(filter file,$(origin ARCH)),portable,$(ARCH)) dist

# With the program of the newest wheel in dist/, if there is one.
blender:
	@scripts/blender_addon $$(ls -t dist/covary-*.whl 2> /dev/null | head -n 1) dist/covary-blender.zip

dev clang:
	@scripts/setup $@
	@cmake --preset $@ -DCOVARY_ARCH=$(ARCH) > /dev/null
	@cmake --build build/$@ -j $(JOBS)
	@cd build/$@ && $(CTEST)

asan tsan: setup
	@cmake --preset $@ $(CONFIGURE) > /dev/null
	@cmake --build build/$@ -j $(JOBS)
	@cd build/$@ && ../../scripts/sanitized $@ $(CTEST)

clean:
	rm -rf build out dist
