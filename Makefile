# `make study` and `make test` are all a fresh machine needs besides make and Python >= 3.11.

PYTHON ?= python3
JOBS ?= 2
BIN := .venv/bin
READY := .venv/.installed
# The libraries that benchmarks compare with stay out of the study's environment.
BENCH_BIN := .venv-bench/bin
BENCH_READY := .venv-bench/.installed

LOCK := uv pip compile pyproject.toml --universal --fork-strategy fewest --python-version 3.11 \
  --generate-hashes --no-header --no-annotate --quiet

.PHONY: study test check publish lint format bench report docs lock clean

study: $(READY)
	$(BIN)/snakemake -j$(JOBS)

test: $(READY)
	$(BIN)/python -m pytest -n $(JOBS) --dist worksteal

check: $(READY)
	$(BIN)/snakemake -j$(JOBS) check

publish: $(READY)
	$(BIN)/snakemake -j$(JOBS) publish

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/snakemake --lint
	$(BIN)/mypy

format: $(READY)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/snakefmt Snakefile workflow

bench: $(BENCH_READY)
	$(BENCH_BIN)/python -m pytest -q tests/test_benchmarks.py
	$(BENCH_BIN)/python -m benchmarks

report: $(READY)
	$(BIN)/snakemake -j$(JOBS) --report report.html

# Config keys described from the schema; the tests fail if this is forgotten.
docs: $(READY)
	$(BIN)/python -m tests.generated_docs

# Needs uv. The second lock holds only what running on Slurm adds to the first.
lock:
	$(LOCK) --extra dev --output-file requirements.lock
	$(LOCK) --extra slurm --constraints requirements.lock --output-file requirements-slurm.lock \
	  $$(sed -n 's/^\([^ ]*\)==.*/--no-emit-package \1/p' requirements.lock)

clean:
	rm -rf .venv .venv-bench .snakemake results/targets results/measurements results/traces \
	  results/identifications results/histories results/timings results/calibrations \
	  results/identifiability results/coverage results/selection results/summaries \
	  results/robustness results/linearisation.csv results/tables \
	  results/figures results/logs report.html

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
