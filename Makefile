# `make study` and `make test` are all a fresh machine needs besides make and Python >= 3.11.

PYTHON ?= python3
JOBS ?= 2
BIN := .venv/bin
READY := .venv/.installed
# The libraries that benchmarks compare with stay out of the study's environment.
BENCH_BIN := .venv-bench/bin
BENCH_READY := .venv-bench/.installed
# So does what the field uses: RheoJAX asks for a newer Python and other libraries.
FIELD_PYTHON ?= python3.12
FIELD_BIN := .venv-field/bin
FIELD_READY := .venv-field/.installed
# So does what builds the site, which reads the code and does not run it.
SITE_BIN := .venv-site/bin
SITE_READY := .venv-site/.installed

LOCK := uv pip compile --universal --fork-strategy fewest --python-version 3.11 \
  --generate-hashes --no-header --no-annotate --quiet

# What runs in minutes: all but the tests that start Snakemake again and again. test_results.py runs
# a small study from its targets to its report.
QUICK := $(filter-out tests/workflow tests/helpers tests/__init__.py tests/conftest.py tests/generated_docs.py tests/__pycache__, \
  $(wildcard tests/*)) tests/workflow/test_results.py

.PHONY: study test test-lowest test-pythons check verify publish publish-overlays lint format bench bench-field report docs site pinned lock clean

study: $(READY)
	$(BIN)/biogrip run -j$(JOBS)

# One worker more than there are processors: some wait for the programs that they have started.
test: $(READY)
	$(BIN)/python -m pytest -n $$(($(JOBS) + 1)) --dist worksteal

# A small study and the quick tests, weekly and before a release: with the oldest versions that
# pyproject.toml allows, and with whichever other Pythons there are, at least one.
test-lowest:
	$(PYTHON) -m venv --clear .venv-lowest
	.venv-lowest/bin/python -m pip install --quiet --require-hashes -r requirements-lowest.lock
	.venv-lowest/bin/python -m pip install --quiet --no-deps --no-build-isolation -e .
	.venv-lowest/bin/ruff check .
	.venv-lowest/bin/ruff format --check .
	.venv-lowest/bin/snakefmt --check Snakefile workflow
	.venv-lowest/bin/python -m pytest -q -n $(JOBS) $(QUICK)

test-pythons:
	ran=; \
	for version in 3.12 3.13; do \
	  python$$version --version || { echo "test-pythons: skipped Python $$version, which is not there" >&2; continue; }; \
	  python$$version -m venv --clear .venv-$$version && \
	  .venv-$$version/bin/python -m pip install --quiet --require-hashes -r requirements.lock && \
	  .venv-$$version/bin/python -m pip install --quiet --no-deps --no-build-isolation -e . && \
	  .venv-$$version/bin/python -m pytest -q -n $(JOBS) $(QUICK) || exit 1; \
	  ran="$$ran $$version"; \
	done; \
	test -n "$$ran" || { echo "test-pythons: nothing ran" >&2; exit 1; }; \
	echo "test-pythons: ran with Python$$ran"

# Every result read again, and held against the record of what was written.
verify: $(READY)
	$(BIN)/biogrip verify

check: $(READY)
	$(BIN)/snakemake -j$(JOBS) check

publish: $(READY)
	$(BIN)/snakemake -j$(JOBS) publish

# What the overlays give that the documentation speaks of; takes longer than the study.
publish-overlays: $(READY)
	overlays=$$($(BIN)/snakemake --list-rules | grep ^publish_) && $(BIN)/snakemake -j$(JOBS) $$overlays

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(READY)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/snakefmt Snakefile workflow

# All of it, or only what SECTIONS names, the rest of the report staying as it is.
bench: $(BENCH_READY)
	$(BENCH_BIN)/python -m pytest -q tests/test_benchmarks.py
	$(BENCH_BIN)/python -m benchmarks $(SECTIONS)

bench-field: $(FIELD_READY)
	PYTHONPATH=src $(FIELD_BIN)/python -m benchmarks.field

report: $(READY)
	$(BIN)/snakemake -j$(JOBS) --report report.html --report-metadata workflow/report/results.yaml

# Config keys described from their classes, and a JSON Schema for editors; the tests fail if this is forgotten.
docs: $(READY)
	$(BIN)/python -m tests.generated_docs

# A link or an anchor that leads nowhere is an error; not with --quiet, which counts no warnings.
site: $(SITE_READY)
	NO_MKDOCS_2_WARNING=1 $(SITE_BIN)/mkdocs build --strict --clean

# The pictures that figures are compared with; look at what has changed before committing them.
pinned: $(READY)
	$(BIN)/python -m pytest -q tests/products/figures/test_pinned.py --pin

# Needs uv. The other locks hold only what running on Slurm, and benchmarks, add to the first, of
# which they may need what is there for PyPy only.
lock:
	$(LOCK) pyproject.toml --extra dev --output-file requirements.lock
	for extra in slurm:requirements-slurm.lock bench:benchmarks/requirements.lock; do \
	  $(LOCK) pyproject.toml --extra $${extra%%:*} --constraints requirements.lock --output-file $${extra#*:} \
	    $$(sed -n "/'pypy'/! s/^\([^ ]*\)==.*/--no-emit-package \1/p" requirements.lock) || exit 1; \
	done
	$(subst 3.11,3.12,$(LOCK)) pyproject.toml benchmarks/field/requirements.in \
	  --output-file benchmarks/field/requirements.lock
	$(LOCK) --group docs --output-file docs/requirements.lock
	$(LOCK) pyproject.toml --extra dev --extra bench --resolution lowest-direct --output-file requirements-lowest.lock

# Of the results only what the study wrote.
clean:
	test ! -x $(BIN)/biogrip || $(BIN)/biogrip clean
	rm -rf .venv .venv-bench .venv-field .venv-site .venv-lowest .venv-3.12 .venv-3.13 .snakemake report.html site

$(READY): requirements.lock pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation -e .
	touch $(READY)

$(BENCH_READY): requirements.lock benchmarks/requirements.lock pyproject.toml
	test -x $(BENCH_BIN)/python || $(PYTHON) -m venv .venv-bench
	$(BENCH_BIN)/python -m pip install --quiet --require-hashes -r requirements.lock -r benchmarks/requirements.lock
	$(BENCH_BIN)/python -m pip install --quiet --no-deps --no-build-isolation -e .
	touch $(BENCH_READY)

$(FIELD_READY): benchmarks/field/requirements.lock
	test -x $(FIELD_BIN)/python || $(FIELD_PYTHON) -m venv .venv-field
	$(FIELD_BIN)/python -m pip install --quiet --require-hashes -r benchmarks/field/requirements.lock
	touch $(FIELD_READY)

$(SITE_READY): docs/requirements.lock
	test -x $(SITE_BIN)/python || $(PYTHON) -m venv .venv-site
	$(SITE_BIN)/python -m pip install --quiet --require-hashes -r docs/requirements.lock
	touch $(SITE_READY)
