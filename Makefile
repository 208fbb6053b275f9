# Each command sets up what it needs, and is quick the second time.
#   make demo          the sample scene rendered by Cycles and by the tracer, compared; ends with the report
#   make quick         lint and the tests that need neither Blender nor processes nor many samples; under a minute
#   make test          lint and the tests that are quick to run, with the newest bpy wheel for the Python found; about four minutes on two cores
#   make test-fresh    make demo and make test on a bare Debian 12 of its own, as a newcomer has them; needs root
#   make test-exhaustive  the rest of them: whole pictures, whole clusters, and what takes minutes: 10⁸ rays, hundreds of thousands of hostile numbers
#   make test-sanitizers  the core compiled with sanitizers, and what its tests find of addresses, undefined behavior and threads
#   make test-matrix   the tests with Blender 4.2 (and 5.2 where there is a Python 3.13) as wheels; those of Blender with 4.5 and 5.0
#   make test-light    whole pictures of light, 1024 samples a pixel, against Cycles of each of these
#   make test-blender  the extension in a real Blender 5.2: $BLENDER, or blender on the PATH, or Debian's in a folder of its own
#   make test-windows  the add-on on Windows, which wine stands for: with Blender 4.2 and 5.0 for Windows, and the suite inside
#   make test-windows-smoke  what is quick of it: the core's pictures, and the wheels of the zip in 4.2
#   make test-arm64    the core's bits on Linux for arm64, under qemu
#   make test-zips     all zips and the libraries in them against what their platforms' loaders and Blenders' installers ask
#   make extension     dist/virtual_pinhole-VERSION-PLATFORM.zip for artists, built by that Blender
#   make artist-pictures  docs/images/artists anew, by a tour in that Blender's window
#   make report-picture  docs/images/report.png anew, by a browser: Chromium
#   make scenes        sample_scenes/*.blend anew, by Blender 4.2
#   make charts        docs/charts anew: every method up to where it fails
#   make bench         all benchmarks of speed and labels, some with charts in docs/charts; fails where a target is missed
#   make bench-guard   whether the tracer has become slower than it was, as a share of bare Embree's speed; a minute or two
#   make clean         removes all that these made, but for ~/.cache/virtual-pinhole

.PHONY: demo quick test test-fresh test-exhaustive test-sanitizers lint test-matrix test-light test-blender test-windows test-windows-smoke test-windows-suite test-arm64 test-zips extension artist-pictures report-picture scenes charts bench bench-guard clean
.DELETE_ON_ERROR:

# bpy has wheels for these two only.
ifndef PYTHON
PYTHON := $(shell .ci/python 3.11 3.13)
endif
PYTHON_FOUND = $(if $(PYTHON),$(PYTHON),$(error Python 3.11 or 3.13 is needed, the only ones that bpy 5 has wheels for: install one or say make PYTHON=...))
PROJECT = pyproject.toml blender_manifest.toml .ci/environment.py hatch_build.py $(shell find viewcam_addon/tracer/core -name '*.h' -o -name '*.cpp')
PYTEST = env -u BLENDER $(1)/bin/python -m pytest
# Each process begins with a part of the list as it stands, so that a file's tests share what is dear to make, and ends with what is
# left of another's. At most four, for each may need a gigabyte or two.
PARALLEL = $(PYTEST) --numprocesses=auto --maxprocesses=4 --dist=worksteal

demo: .venv/demo
	.venv/bin/viewcam demo

# For the inner loop. What a version of NumPy or Python may change stands in these, so that the matrix has them, too.
# Chosen by their source and not by markers: a marker is known once a module is imported, and an import of bpy makes the session
# one with Blender, whose OpenUSD and that of the judges can't be in one process on Windows.
QUICK := $(shell grep -rLE --include='test_*.py' 'importorskip\("bpy"\)|fresh_blender|stand_in|subprocess' \
	tests/cameras tests/commands tests/comparison tests/datasets tests/jobs tests/tracer tests/test_*.py \
	| grep -vE 'adaptive|audit|hostile|hypothesis|noise|project|roll|sabotage|sampler|test_text\.py' | sort)

quick: .venv/test
	.venv/bin/python -m ruff check .
	.venv/bin/python -m ruff format --check .
	$(call PARALLEL,.venv) --hypothesis-profile=quick $(QUICK)

# mypy is one process: beside the tests it takes no time of its own.
test: .venv/test
	.venv/bin/python -m ruff check .
	.venv/bin/python -m ruff format --check .
	.venv/bin/python -m mypy & types=$$!; $(call PARALLEL,.venv); tests=$$?; wait $$types && exit $$tests

test-fresh:
	.ci/fresh-machine "make demo" "make test"

# Slow tests that need Blender are run with the oldest and the newest: test-matrix and test-blender.
test-exhaustive: .venv/test
	$(call PARALLEL,.venv) --numprocesses=3 -m "exhaustive or (slow and not blender)"

# GCC's sanitizers, which come with it: preloaded, since Python itself is compiled without them.
sanitizers-address = address,undefined
preload-address = $(shell g++ -print-file-name=libasan.so) $(shell g++ -print-file-name=libubsan.so)
sanitizers-thread = thread
preload-thread = $(shell g++ -print-file-name=libtsan.so)
# The loader frees a thread's storage that a later thread gets anew: it is ordered by locks of its own, which GCC 12's sanitizer does
# not see.
suppressed = race:_dl_deallocate_tls
# Faults between threads show where there are some; the others are looked for on one.
tests-address = tests/tracer/test_c_interface.py tests/tracer/test_leaks.py tests/tracer/test_render.py tests/tracer/test_triangles.py \
	tests/tracer/light/test_textbook.py tests/tracer/light/test_textures.py
calls-address = VIEWCAM_FUZZ_CALLS=150
tests-thread = tests/tracer/test_intersection.py tests/tracer/test_render.py tests/tracer/test_render_light.py -k "thread or triangle_takes or stops_within"
test-sanitizers: test-sanitizer-address test-sanitizer-thread

test-sanitizer-%: .venv/test
	CXX=g++ .venv/bin/python hatch_build.py --sanitize $(sanitizers-$*) --into build/sanitized/$*
	echo $(suppressed) > build/sanitized/$*/suppressed
	env -u BLENDER LD_PRELOAD="$(preload-$*)" ASAN_OPTIONS=detect_leaks=0 TSAN_OPTIONS="halt_on_error=1 suppressions=build/sanitized/$*/suppressed" PYTHONPATH=build/sanitized/$* \
	VIEWCAM_LEAK_RAYS=300 $(calls-$*) .venv/bin/python -m pytest -p no:cacheprovider $(tests-$*)

lint: .venv/test
	.venv/bin/python -m ruff check .
	.venv/bin/python -m ruff format --check .
	.venv/bin/python -m mypy

.venv/demo: $(PROJECT)
	$(PYTHON_FOUND) .ci/environment.py .venv --editable '.[blender]'
	.venv/bin/python -c 'import bpy'
	touch $@

.venv/extension: $(PROJECT)
	$(PYTHON_FOUND) .ci/environment.py .venv --editable '.[blender,extension]'
	touch $@

.venv/test: $(PROJECT)
	$(PYTHON_FOUND) .ci/environment.py .venv --editable '.[blender,test,judges]'
	.venv/bin/python -c 'import bpy'
	touch $@ .venv/demo

# The environment that makes zips, beside the tests of them.
.venv/zips: .venv/test
	$(PYTHON_FOUND) .ci/environment.py .venv --editable '.[extension]'
	touch $@

# One environment for each Blender, with the NumPy that this Blender brings along where the wheel leaves it open.
wheel-4.2 = bpy==4.2.23 numpy==1.24.*
wheel-4.4 = bpy==4.4.0
wheel-4.5 = bpy==4.5.15
wheel-5.0 = bpy==5.0.1
wheel-5.2 = bpy==5.2.3
python-4.2 = 3.11
python-4.4 = 3.11
python-4.5 = 3.11
python-5.0 = 3.11
python-5.2 = 3.13
WHEELS := 4.2 4.4 4.5 5.0 $(if $(shell .ci/python 3.13),5.2)
# make test has one of them.
TESTED := $(shell $(PYTHON) -c 'import sys; print("5.0" if sys.version_info[:2] == (3, 11) else "5.2")')
MATRIX := $(filter-out $(TESTED),$(WHEELS))

test-matrix: $(MATRIX:%=test-wheel-%)
	@$(if $(filter 5.2,$(WHEELS)),,echo "NOT TESTED: the wheel of Blender 5.2, since there is no Python 3.13 on the PATH or in pyenv")

# The tests whose outcome a version can change: those that touch Blender; with the oldest and the newest, which have NumPys of
# their own, the quick ones; with the newest, which has a Python of its own, processes. Of the newest, tests/blender runs inside
# the real one, but for lights and batches (test-blender). What is slow of lights the newest has alone, what is slow of batches
# the oldest. Between the two, 4.4 has what its Cycles alone shades so; 4.5 has what versions.py tells apart: scenes, pictures,
# animation; 5.0 has the rest, and test-light what Cycles shades. The faults that are made on purpose, and the sample scenes, are the oldest's, whose files the
# latter are.
TOUCHING_BLENDER = tests/blender tests/test_crashes.py \
	$(shell grep -lE 'importorskip\("bpy"\)' tests/test_*.py tests/commands/test_*.py tests/comparison/test_*.py | grep -v test_project)
tests-4.4 = tests/blender/light/test_closures.py tests/blender/light/test_normals.py
without-4.4 = $(without-4.5)
tests-4.5 = tests/blender $(foreach each,interface jobs light,--ignore=tests/blender/$(each))
without-4.5 = $(empty) and not slow
tests-5.0 = $(TOUCHING_BLENDER)
SLOW_LIGHT := $(shell grep -lE '^pytestmark = .*slow' tests/blender/light/*.py) tests/blender/test_light_by_light.py
without-4.2 = $(empty) and (blender or not slow)
tests-4.2 = $(TOUCHING_BLENDER) $(QUICK) $(SLOW_LIGHT:%=--ignore=%)
without-5.2 = $(without-4.2)
tests-5.2 = tests/blender/light tests/blender/test_light_by_light.py $(filter-out tests/blender tests/test_leftovers.py tests/comparison/test_sabotage_on_cycles.py,$(TOUCHING_BLENDER)) $(QUICK) tests/jobs

# Few examples of each property: make test has the many, and what a version changes, it changes for most of them. What is slow
# begins first (tests/conftest.py), so that no process ends with it alone.
test-wheel-%: .venvs/%/ready
	$(call PARALLEL,.venvs/$*) --hypothesis-profile=quick -m "not exhaustive and not light and not speed$(without-$*)" $(tests-$*)

test-light: $(patsubst %,test-light-%,$(filter-out 4.4,$(MATRIX)))

# The oldest and the newest share the scenes out, the newest having those that take long; of the versions between them one or two
# tell whether Cycles shades otherwise.
light-4.2 = -k "not (interior or street or foliage or toys or studio or metals or wide or flight or spheres or bunny)"
light-5.2 = -k "not (cornell or roadster or fairground or gallery or glassware or backdrop or portrait or straight_down or spot or teapot)"
light-4.5 = -k "cornell or perfume"

test-light-%: .venvs/%/ready
	$(call PYTEST,.venvs/$*) tests/test_against_cycles.py -m light $(light-$*)

.venvs/%/ready: $(PROJECT)
	python=$$(.ci/python $(python-$*)) || { echo "Blender $*'s wheel needs Python $(python-$*), and there is none on the PATH or in pyenv"; exit 1; }; \
	$$python .ci/environment.py .venvs/$* $(wheel-$*) --editable '.[test]'
	touch $@
.PRECIOUS: .venvs/%/ready

# The zip built by a real Blender, in that Blender and in those that are wheels; and the panel in a window.
test-blender: .venv/zips $(patsubst %,.venvs/%/ready,$(filter 4.2 4.5,$(WHEELS)))
	BLENDER=$$(.ci/find-blender) || exit 1; export BLENDER; \
	.venv/bin/python -m pytest --numprocesses=2 --dist=loadfile --no-loadscope-reorder tests/real_blender

# Python for Windows and for arm64 lie in ~/.cache/virtual-pinhole/emulated, made once: .ci/emulated.py.
PLATFORMS = $(call PYTEST,.venv) -m platforms

test-windows: .venv/zips $(patsubst %,.venvs/%/ready,$(filter 4.2 5.0,$(MATRIX)))
	$(PLATFORMS) tests/platforms/test_emulated.py -k "not arm64"
	$(MAKE) test-windows-suite

test-windows-smoke: .venv/zips
	$(PLATFORMS) tests/platforms/test_emulated.py -k smoke

# With the newer one what is quick and needs no Blender, then what touches it, and what of files, processes and consoles is
# Windows' own; with the older one what touches Blender. The first is apart, since of libraries of one name a process has one on
# Windows: OpenUSD's, which judges cameras, and Blender's are both called usd_ms.dll.
WINDOWS_PYTEST = -m pytest -p no:cacheprovider --numprocesses=2 --dist=loadfile --hypothesis-profile=quick
# Modules that are slow as a whole, and so left out, are not imported either: each takes seconds under wine.
SLOW = $(shell grep -rlE --include='test_*.py' '^pytestmark.*mark\.(slow|exhaustive)' tests)
WINDOWS_BLENDER = $(filter-out $(SLOW),$(shell find tests/blender -name 'test_*.py' | sort))
WINDOWS_OWN = $(filter-out $(QUICK),$(wildcard tests/jobs/test_*.py tests/labels/test_*.py tests/commands/test_*.py) \
	tests/tracer/test_c_interface.py tests/test_files.py tests/test_child_process.py tests/test_terminal.py tests/test_cli.py \
	tests/test_crashes.py)
# Slow modules that run there all the same, for what they call is compiled for Windows: OpenUSD, OpenCV, Blender's odd files.
WINDOWS_SLOW = $(WINDOWS_PYTEST) -m "slow and not exhaustive"
test-windows-suite: .venv/zips
	status=0; \
	.venv/bin/python .ci/emulated.py windows-5.0 $(WINDOWS_SLOW) tests/cameras/test_usd.py tests/cameras/test_undistortion.py || status=1; \
	.venv/bin/python .ci/emulated.py windows-5.0 $(WINDOWS_SLOW) tests/blender/scenes/test_features.py tests/blender/test_odd_blender.py || status=1; \
	.venv/bin/python .ci/emulated.py windows-5.0 $(WINDOWS_PYTEST) $(filter-out $(SLOW),$(QUICK)) || status=1; \
	.venv/bin/python .ci/emulated.py windows-5.0 $(WINDOWS_PYTEST) $(WINDOWS_BLENDER) $(filter-out $(SLOW),$(WINDOWS_OWN)) || status=1; \
	.venv/bin/python .ci/emulated.py windows-4.2 $(WINDOWS_PYTEST) $(WINDOWS_BLENDER) || status=1; \
	exit $$status

test-arm64: .venv/zips
	$(PLATFORMS) tests/platforms/test_emulated.py -k arm64

test-zips: .venv/zips extension
	$(PLATFORMS) tests/platforms/test_libraries.py tests/platforms/test_zips.py

extension: .venv/extension
	blender=$$(.ci/find-blender) || exit 1; \
	.venv/bin/python .ci/extension.py "$$blender" dist $(PLATFORM)

artist-pictures: .venv/test
	BLENDER=$$(.ci/find-blender) || exit 1; export BLENDER; \
	VIEWCAM_PICTURES=docs/images .venv/bin/python -m pytest tests/real_blender/test_window.py -k tour -o faulthandler_timeout=0

report-picture: .venv/test
	@command -v chromium >/dev/null || { echo "A browser is needed: install chromium" >&2; exit 1; }
	.venv/bin/viewcam check sample_scenes/studio.blend --size 1280x720 --report build/report
	chromium --headless --no-sandbox --hide-scrollbars --window-size=1200,1180 --force-device-scale-factor=0.667 \
	    --screenshot=docs/images/report.png "file://$(CURDIR)/build/report/index.html"

# Blender 4.2 writes them, so that every later one opens them.
scenes: .venvs/4.2/ready
	.venvs/4.2/bin/python sample_scenes/make.py

charts: .venv/test
	.venv/bin/python -m benchmarks stability --json docs/charts/stability.json
	.venv/bin/python -m benchmarks light --json docs/charts/light.json

bench: .venv/test
	status=0; \
	.venv/bin/python -m benchmarks.labels || status=1; \
	.venv/bin/python -m benchmarks speed --json docs/charts/speed.json || status=1; \
	exit $$status

bench-guard: .venv/test
	$(call PYTEST,.venv) -m speed

clean:
	rm -rf .venv .venvs .pytest_cache .ruff_cache .hypothesis wheels dist build demo
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
