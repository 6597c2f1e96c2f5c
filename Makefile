# make help lists the targets.
CONFIG ?= release
CC ?= cc
CXX ?= c++
PKG_CONFIG ?= pkg-config
MESH ?= 1
B := build/$(CONFIG)

CFLAGS ?= -O2 -g
CFLAGS_debug := -O0 -g
CFLAGS_asan := -O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer
CFLAGS_tsan := -O1 -g -fsanitize=thread
CFLAGS_fuzz := $(CFLAGS_asan) -fsanitize=fuzzer-no-link
# sweep: comparisons are not traced, which is more than twice as fast; dictionaries know the words.
CFLAGS_sweep := $(CFLAGS_fuzz) -O2 -fno-sanitize-coverage=trace-cmp
# -ffp-contract=off: stored values must not depend on whether a machine has fused operations.
# -fno-trapping-math, -fno-math-errno: change no value, but let loops with conditions become vectors.
FLAGS := -D_POSIX_C_SOURCE=200809L -D_FILE_OFFSET_BITS=64 -ffile-prefix-map=$(CURDIR)=. -ffp-contract=off -fno-trapping-math -fno-math-errno -pthread -MMD -MP \
	-Wall -Wextra -Wconversion -Wshadow $(if $(WERROR),-Werror) -Iformat -Ilibbuild -Iviewer -Icmd -Itests -Itests/fuzz
ALL_CFLAGS = -std=c11 $(FLAGS) -Wstrict-prototypes $(or $(CFLAGS_$(CONFIG)),$(CFLAGS))
ALL_CXXFLAGS = -std=c++17 $(FLAGS) -Wno-conversion -Wno-shadow -Wno-maybe-uninitialized $(or $(CFLAGS_$(CONFIG)),$(CFLAGS))

LIBS_format := -lzstd -lxxhash -lm
LIBS_build := $(LIBS_format) -luv -lpng -ljpeg -lm
LIBS_viewer := $(LIBS_format) -lOSMesa -lpng -luv
LIBS_window := -lglfw
LIBS_cmd := -ljansson
LIBS_test := -lcheck -lsubunit -lrt

obj = $(patsubst %,$(B)/obj/%.o,$(basename $(1)))
FORMAT := $(call obj,$(wildcard format/*.c))
BUILD := $(call obj,$(wildcard libbuild/*.c))
VIEWER := $(call obj,$(wildcard viewer/*.c))
CLI := $(call obj,cmd/cli.c)
META := $(call obj,cmd/meta.c)
TOOLS := $(patsubst cmd/%.c,%,$(wildcard cmd/spc_*.c))
TESTS := $(filter-out $(if $(filter 1,$(MESH)),,test_mesh_shim test_assimp),$(patsubst tests/%.c,%,$(wildcard tests/test_*.c)))
FAULTS := faults_inject.so $(patsubst tests/faults/%.c,%,$(wildcard tests/faults/faults_s*.c))
BINARIES := $(addprefix $(B)/,$(subst _,-,$(TOOLS))) $(B)/gen-scan

# V=1 shows the commands
Q := $(if $(V),,@)
say := @echo "  "

.PHONY: all demo check tests fuzz fuzzers sweep flips conformance soak asan tsan bench decisions points deps deps-check experiments format tidy layers install uninstall deb clean help
.SECONDARY:                     # keep objects
all: $(BINARIES)                ## the tools, into build/release/

# loops that are written to become vectors
$(if $(filter release,$(CONFIG)),$(FORMAT) $(BUILD) $(VIEWER)): ALL_CFLAGS += -O3

$(B)/obj/%.o: %.c Makefile
	@mkdir -p $(@D)
	$(say) CC $<
	$(Q)$(CC) $(ALL_CFLAGS) -c $< -o $@

$(B)/obj/%.o: %.cpp Makefile
	@mkdir -p $(@D)
	$(say) CXX $<
	$(Q)$(CXX) $(ALL_CXXFLAGS) -c $< -o $@

$(B)/libspc.a: $(FORMAT)
$(B)/libspb.a: $(BUILD)
$(B)/libspv.a: $(VIEWER)
$(B)/lib%.a:
	@rm -f $@
	$(Q)$(AR) rcs $@ $^

LINK = $(say) LINK $@ && $(CC) $(ALL_CFLAGS) $(LDFLAGS) $(filter %.o,$^) $(filter %.a,$^) -o $@
$(B)/spc-build: $(call obj,cmd/spc_build.c $(wildcard cmd/build_*.c) cmd/usage.c) $(CLI) $(META) $(B)/libspb.a $(B)/libspc.a
	$(LINK) $(LIBS_build) $(LIBS_cmd)
$(B)/spc-info: $(call obj,cmd/spc_info.c $(wildcard cmd/info_*.c)) $(CLI) $(META) $(B)/libspb.a $(B)/libspc.a
	$(LINK) $(LIBS_build) $(LIBS_cmd)
$(B)/spc-render: $(call obj,cmd/spc_render.c $(wildcard cmd/render_*.c) cmd/picture.c) $(CLI) $(META) $(B)/libspv.a $(B)/libspc.a
	$(LINK) $(LIBS_viewer) $(LIBS_cmd)
$(B)/spc-view: $(call obj,cmd/spc_view.c $(wildcard cmd/view*.c) cmd/picture.c) $(CLI) $(META) $(B)/libspv.a $(B)/libspc.a
	$(LINK) $(LIBS_viewer) $(LIBS_window) $(LIBS_cmd)
$(B)/spc-bench: $(call obj,cmd/spc_bench.c $(wildcard cmd/bench_*.c) cmd/ref_raster.c cmd/picture.c) $(CLI) $(META) $(B)/libspv.a $(B)/libspb.a $(B)/libspc.a
	$(LINK) $(LIBS_viewer) $(LIBS_build) $(LIBS_cmd)
$(B)/gen-scan: $(call obj,scripts/gen_scan.c)
	$(LINK) -lm

demo: ; @$(MAKE) -s deps && $(MAKE) -j$$(nproc) all && scripts/demo $(SCAN)         ## install what is missing, build, convert and show a scan (SCAN=path)
check: ; @$(MAKE) -s deps-check && $(MAKE) -j$$(nproc) all tests && scripts/check $(B)  ## install what is missing, build and test
deps: ; @scripts/install_deps build
deps-check: ; @scripts/install_deps build test $(if $(filter 1,$(MESH)),mesh)

# One program a test file; helpers of tests are tests/*.c without the prefix.
TEST_HELPERS := $(call obj,$(filter-out tests/test_% %/fuzz_entry.c %/fuzz_corpus.c,$(wildcard tests/*.c tests/fuzz/*.c)))
tests: $(addprefix $(B)/tests/,$(TESTS)) $(B)/bench-frames $(B)/bench-shares $(B)/conformance_dump $(B)/window_probe $(addprefix $(B)/tests/,$(FAULTS))
$(B)/libtest.a: $(TEST_HELPERS) $(call obj,cmd/ref_raster.c)
$(B)/tests/test_%: $(call obj,tests/test_%.c) $(B)/libtest.a $(B)/libspv.a $(B)/libspb.a $(B)/libspc.a
	@mkdir -p $(@D)
	$(LINK) $(LIBS_test) $(LIBS_viewer) $(LIBS_window) $(LIBS_build) $(LIBS_cmd)
$(B)/tests/test_mesh_shim: $(call obj,libbuild/mesh_shim.cpp)
$(B)/tests/test_mesh_shim: LIBS_test += -lOpenMeshCore -lstdc++
$(B)/tests/test_metrics: $(call obj,cmd/bench_metrics.c)
$(B)/tests/test_bench: $(call obj,cmd/bench_recommend.c cmd/bench_paths.c cmd/bench_views.c)
$(B)/tests/test_assimp: LIBS_test += -lassimp

# Faults of the system: a library before libc, and programs that run the tools with it.
$(B)/tests/faults_inject.so: tests/faults/inject.c tests/faults/faults.h Makefile
	@mkdir -p $(@D)
	$(say) LINK $@ && $(CC) -std=c11 -O1 -g -Wall -Wextra -Wconversion -Wshadow $(if $(WERROR),-Werror) -shared -fPIC $< -o $@ -ldl
$(B)/tests/faults_%: $(call obj,tests/faults/faults_%.c tests/faults/faults_run.c)
	@mkdir -p $(@D)
	$(LINK)

# A window for tests/cli/window.sh to act on.
$(B)/window_probe: $(call obj,tests/window/window_probe.c) $(B)/libspv.a $(B)/libspc.a
	$(LINK) $(LIBS_viewer) $(LIBS_window)

# Programs that measure: a file each in tests/bench/, built only for it. select and count need no GL.
$(B)/bench-bandwidth: $(call obj,tests/bench/bandwidth.c)
	$(LINK)
$(B)/bench-clouds: $(call obj,tests/bench/clouds.c) $(B)/libspb.a $(B)/libspc.a
	$(LINK) $(LIBS_build)
$(B)/bench-readers: $(call obj,tests/bench/readers.c) $(B)/libspb.a $(B)/libspc.a
	$(LINK) $(LIBS_build)
$(B)/bench-frames $(B)/bench-render: $(B)/bench-%: $(call obj,tests/bench/%.c) $(B)/libspv.a $(B)/libspc.a
	$(LINK) $(LIBS_viewer)
$(B)/bench-%: $(call obj,tests/bench/%.c) $(B)/libspv.a $(B)/libspc.a
	$(LINK) $(LIBS_format)
bench: ; @scripts/install_deps build bench && $(MAKE) -j$$(nproc) all $(B)/bench-decode $(B)/bench-readers $(B)/bench-bandwidth && scripts/bench $(B) $(SCAN) && scripts/scaling $(B)  ## cost of the codecs, on a generated scan (SCAN=path: and on that one), and of larger scans (SCALING="1 10" million triangles)
decisions: ; @$(MAKE) -s deps && $(MAKE) -j$$(nproc) all $(B)/bench-decisions $(B)/bench-orders && scripts/decisions $(B)  ## tables of spec/decisions.md, some minutes (SPC_DATA=folder: on folder/scans too)
experiments: ; @$(MAKE) -s deps && $(MAKE) -j$$(nproc) all $(B)/bench-frames $(B)/bench-shares && scripts/experiments $(B)  ## the papers' findings, measured: tables of spec/experiments.md, about twenty minutes (SPC_DATA=folder: on folder/scans too; PARTS="times hybrid")
points: ; @$(MAKE) -s deps && $(MAKE) -j$$(nproc) all $(B)/bench-clouds && scripts/points $(B)  ## how well disks of points cover, some minutes (SPC_DATA=folder: on four of folder/scans too)

# The same targets as in tests/test_fuzz_replay.c, driven by libFuzzer of clang.
FUZZERS := $(addprefix $(B)/,fuzz_open fuzz_decode fuzz_verify)
SCAN_FUZZERS := $(addprefix $(B)/,fuzz_ply fuzz_stl fuzz_off fuzz_obj)
FUZZ_SECONDS ?= 60
SWEEP_RUNS ?= 100000000
fuzzers: $(FUZZERS) $(SCAN_FUZZERS) $(B)/fuzz_corpus
$(FUZZERS): FUZZ_FLAGS := -DFUZZ_RESEAL
$(FUZZERS) $(SCAN_FUZZERS): $(B)/fuzz_%: tests/fuzz/fuzz_entry.c $(B)/libtest.a $(B)/libspb.a $(B)/libspc.a Makefile
	$(say) LINK $@ && $(CC) $(ALL_CFLAGS) -fsanitize=fuzzer $(FUZZ_FLAGS) -DFUZZ_TARGET=fuzz_$* $(filter %.c %.a,$^) -o $@ $(LIBS_build)
$(B)/fuzz_corpus: $(call obj,tests/fuzz/fuzz_corpus.c) $(B)/libtest.a $(B)/libspb.a $(B)/libspc.a
	$(LINK) $(LIBS_test) $(LIBS_build)
fuzz: ; @scripts/install_deps build test fuzz && $(MAKE) CONFIG=fuzz CC=clang fuzzers && scripts/fuzz build/fuzz $(FUZZ_SECONDS)  ## put random archives into the reader, FUZZ_SECONDS=60 a target; needs clang
sweep: ; @scripts/install_deps build test fuzz && $(MAKE) CONFIG=sweep CC=clang fuzzers && RUNS=$(SWEEP_RUNS) scripts/fuzz build/sweep 86400 $(notdir $(SCAN_FUZZERS))  ## SWEEP_RUNS=100000000 random scans a format, half an hour each

# Archives that other readers are tried on; committed, made anew only when the format changes.
$(B)/make_conformance: $(call obj,tests/conformance/make_conformance.c) $(B)/libtest.a $(B)/libspb.a $(B)/libspc.a
	$(LINK) $(LIBS_test) $(LIBS_build)
$(B)/conformance_dump: $(call obj,tests/conformance/dump.c) $(B)/libspc.a
	$(LINK) $(LIBS_format)
conformance: $(B)/make_conformance    ## write spec/conformance anew
	rm -f spec/conformance/good/*.spc spec/conformance/bad/*.spc
	mkdir -p spec/conformance/good spec/conformance/bad
	SPC_CONFORMANCE=spec/conformance $<

FLIPS ?= 20000
flips: $(B)/tests/test_flips   ## turn FLIPS=20000 bits in larger archives, each of which must be found
	SPC_FLIPS=$(FLIPS) SPC_FLIPS_TRIANGLES=20000 $<

soak: ; @$(MAKE) -s deps-check && $(MAKE) -j$$(nproc) all tests && scripts/soak $(B)   ## faults of the system, extremes, the worst that is found: some twenty-five minutes (SPC_SEED=N)

# Folders come from the environment or the command line; scripts/install has their defaults.
install: all $(B)/libspc.a      ## tools, library, manual pages, completions: PREFIX=/usr/local DESTDIR= BINDIR= LIBDIR= MANDIR= ...
	@scripts/install $(B) $(subst _,-,$(TOOLS))
uninstall: ; @scripts/install --remove $(B) $(subst _,-,$(TOOLS))   ## removes them, given the same folders
deb: ; @scripts/install_deps build deb && $(MAKE) -j$$(nproc) all $(B)/libspc.a && scripts/deb $(B) $(subst _,-,$(TOOLS))  ## Debian packages, into build/deb/

asan: ; $(MAKE) CONFIG=asan CK_FORK=no check                     ## check under address and undefined behaviour sanitizers
tsan: ; $(MAKE) CONFIG=tsan check                     ## check under the thread sanitizer
help: ; @sed -n 's/^\([a-z-]*\):.*## */\1	/p' Makefile | expand -t 10   ## this list
clean: ; rm -rf build                     ## remove build/

-include $(shell find $(B)/obj -name '*.d' 2>/dev/null)
