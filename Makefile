# SPDX-License-Identifier: Apache-2.0
# Entry to the project. `make demo` and `make test` start from a bare Debian 12: they install what is missing, build and
# run.
#
#   make setup            install missing packages (needs root or sudo only when something is missing)
#   make build            build/release/covary
#   make demo             render a small scene plainly, with IICV and by the default into out/
#   make test             build and run all tests but the nightly ones      TESTS=regex selects some
#   make check            all there is: lint of every file, the tests under sanitizers and of a build by Clang with the
#                         checks of the standard library, a minute of each fuzz target; takes hours
#                         FUZZ=seconds for each target
#   make bench            build and run the micro benchmarks: the time of each stage, and what part of its limit it
#                         reaches; build/release/bench.json            BENCH=regex selects some; BASELINE=an earlier
#                         bench.json to compare with; HISTORY=benchmarks/results.md adds a row to that table
#   make lint             formatting, static analysis, rules of the tree    ALL=1 analyses all files, not changed ones
#   make install          build for every x86-64 processor (docs/library.md) and install under PREFIX (default
#                         /usr/local); ARCH=native builds for this machine alone, in a third of the time; with Open
#                         Image Denoise of PyPI (scripts/oidn), but for OIDN=OFF
#   make deb              a package of Debian, of what `make install` installs, in dist/
#   make docs             the documentation as a site, build/site/index.html (Sphinx, from PyPI)
#   make wheel            the Python package as a wheel for every x86-64 processor, and its sources, in dist/
#                         (docs/python.md); ARCH=native for machines like this alone
#   make blender          the add-on of Blender as dist/covary-blender.zip; with the program of a wheel in dist/, if any
#   make asan|tsan        build and run the tests under the sanitizers of addresses, leaks and undefined behaviour;
#                         under that of threads
#   make dev|clang        the same with checks of the standard library, by GCC; by Clang
#   make clean            remove build/ and out/
#
# ARCH=x86-64-v3 builds for every AVX2 machine instead of this one; WERROR=ON makes warnings errors (dev and clang
# always do) until WERROR=OFF, so that what is built once is built for all targets above; JOBS=n limits parallelism
# (default: processors, fewer when memory is short).

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
