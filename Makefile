# `make study` and `make test` are all a fresh machine needs besides make and Python >= 3.11.

PYTHON ?= python3
JOBS ?= 2
BIN := .venv/bin
READY := .venv/.installed
TEST_READY := .venv/.installed-tests
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

LOCK := $(BIN)/uv pip compile --universal --fork-strategy fewest --python-version 3.11 \
  --generate-hashes --no-header --no-annotate --quiet

# Python compiles what is used, once: a quarter of what there is.
unexport PYTHONDONTWRITEBYTECODE
installer = $(1)/bin/python -m pip install --quiet --require-hashes -r requirements-install.lock
# $(call locked,ENVIRONMENT,LOCKS): pip brings uv by a small lock, and uv all else, much faster; then uv,
# 38 MB, goes.
locked = $(call installer,$(1)) && $(1)/bin/python -m uv pip install --quiet --python $(1)/bin/python \
  --require-hashes $(addprefix -r ,$(2)) && $(1)/bin/python -m pip uninstall --quiet --yes uv
# Overlays whose tables are published, each under its name; see `overlaid`.
OVERLAYS := calibration coverage measured power_law readings recorded repaired robustness soft
# $(call overlaid,TARGET,OPTIONS): every overlay in a folder of its own, from where traces are found, too.
overlaid = failed=; for overlay in $(OVERLAYS); do \
  mkdir -p overlays/$$overlay && ln -sfn ../../data overlays/$$overlay/data && \
  $(BIN)/snakemake -j$(JOBS) --configfile config/$$overlay.yaml --directory overlays/$$overlay $(2) $(1) || \
  failed="$$failed $$overlay"; \
done; test -z "$$failed" || { echo "$(1): failed for$$failed" >&2; exit 1; }
ourselves = $(1)/bin/python -m pip install --quiet --no-deps --no-build-isolation -e .
counted = $$(grep -o '^[a-z][^=]*' $(1) | sort -u | wc -l)

# What runs in minutes: of the tests that start Snakemake those of a small study, from its targets to
# its report, and of the module.
QUICK := $(filter-out tests/workflow tests/helpers tests/__init__.py tests/conftest.py tests/generated_docs.py tests/__pycache__, \
  $(wildcard tests/*)) $(addprefix tests/workflow/,test_module.py test_rules.py test_study.py)

# A signal within a minute: of config, files, tables, jobs and rules.
FAST := $(addprefix tests/,study records tables traces stages/test_job.py stages/test_stages.py workflow/test_rules.py \
  test_digits.py test_groups.py test_terminal.py test_table_of_traces.py)

.PHONY: quick study test test-nightly test-lowest test-pythons check check-overlays publish publish-overlays lint format bench bench-field report docs citation site pinned lock clean

study: $(READY)
	$(BIN)/snakemake -j$(JOBS)

# One worker more than there are processors: some wait for the programs that they have started.
test: $(TEST_READY)
	$(BIN)/python -m pytest -n $$(($(JOBS) + 1)) --dist worksteal

quick: $(TEST_READY)
	$(BIN)/python -m pytest -q -x -n $(JOBS) $(FAST)

# What takes longer than a change should wait; nightly, on a machine with Slurm.
test-nightly: $(TEST_READY)
	$(BIN)/python -m pytest -m nightly -n $$(($(JOBS) + 1)) --dist worksteal

# A small study and the quick tests, weekly, nightly and before a release: with the oldest versions that
# pyproject.toml allows, and with whichever other Pythons there are, at least one.
test-lowest:
	$(PYTHON) -m venv --clear .venv-lowest
	$(call locked,.venv-lowest,requirements-lowest.lock)
	$(call ourselves,.venv-lowest)
	.venv-lowest/bin/ruff check .
	.venv-lowest/bin/ruff format --check .
	.venv-lowest/bin/snakefmt --check Snakefile workflow
	.venv-lowest/bin/python -m pytest -q -n $(JOBS) $(QUICK)

test-pythons:
	ran=; \
	for version in 3.12 3.13; do \
	  python$$version --version || { echo "test-pythons: skipped Python $$version, which is not there" >&2; continue; }; \
	  python$$version -m venv --clear .venv-$$version && \
	  $(call locked,.venv-$$version,requirements.lock requirements-dev.lock) && \
	  $(call ourselves,.venv-$$version) && \
	  .venv-$$version/bin/python -m pytest -q -n $(JOBS) $(QUICK) || exit 1; \
	  ran="$$ran $$version"; \
	done; \
	test -n "$$ran" || { echo "test-pythons: nothing ran" >&2; exit 1; }; \
	echo "test-pythons: ran with Python$$ran"

# What is not up to date is made before its tables are compared.
check: $(READY)
	$(BIN)/snakemake -j$(JOBS) check

# The same for every overlay that is published, each as long as a study or longer: nightly, not in CI.
check-overlays: $(READY)
	@$(call overlaid,check)

publish: $(READY)
	$(BIN)/snakemake -j$(JOBS) --config pdf=true -- publish

# What the overlays give that the documentation speaks of; takes longer than the study.
publish-overlays: $(READY)
	@$(call overlaid,publish,--config pdf=true --)

lint: $(TEST_READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(TEST_READY)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/snakefmt Snakefile workflow

bench: $(BENCH_READY)
	$(BENCH_BIN)/python -m benchmarks

bench-field: $(FIELD_READY)
	$(FIELD_BIN)/python -m benchmarks.field

report: $(READY)
	$(BIN)/snakemake -j$(JOBS) --report report.html

# Config keys described from their classes, and a JSON Schema for editors; the tests fail if this is forgotten.
# And the picture of the rules.
docs: $(TEST_READY)
	$(BIN)/python -m tests.generated_docs
	$(BIN)/python docs/rules.py docs/rules.png

# Written from CITATION.cff, after it is checked by its schema.
citation: $(SITE_READY)
	$(SITE_BIN)/cffconvert --validate
	$(SITE_BIN)/cffconvert --format codemeta --outfile codemeta.json
	$(SITE_BIN)/cffconvert --format zenodo --outfile .zenodo.json

# A link or an anchor that leads nowhere is an error; not with --quiet, which counts no warnings.
site: $(SITE_READY)
	$(SITE_BIN)/cffconvert --validate
	$(SITE_BIN)/cffconvert --format codemeta | cmp - codemeta.json
	$(SITE_BIN)/cffconvert --format zenodo | cmp - .zenodo.json
	NO_MKDOCS_2_WARNING=1 $(SITE_BIN)/mkdocs build --strict --clean

# The pictures that figures are compared with; look at what has changed before committing them.
pinned: $(TEST_READY)
	$(BIN)/python -m pytest -q tests/figures/test_pinned.py --pin

# The second lock holds only what tests add to the first, and the next two what running on Slurm,
# and benchmarks, add to both, of which they may need what is there for PyPy only.
lock: $(READY)
	$(call installer,.venv)
	$(LOCK) pyproject.toml --extra study --output-file requirements.lock
	for extra in dev:requirements-dev.lock slurm:requirements-slurm.lock bench:benchmarks/requirements.lock; do \
	  locks=requirements.lock; test $${extra%%:*} = dev || locks="$$locks requirements-dev.lock"; \
	  $(LOCK) pyproject.toml --extra $${extra%%:*} $$(printf -- '--constraints %s ' $$locks) --output-file $${extra#*:} \
	    $$(sed -n "/'pypy'/! s/^\([^ ]*\)==.*/--no-emit-package \1/p" $$locks) || exit 1; \
	done
	$(LOCK) --group install --constraints requirements.lock --constraints requirements-dev.lock \
	  --output-file requirements-install.lock
	$(subst 3.11,3.12,$(LOCK)) pyproject.toml benchmarks/field/requirements.in \
	  --output-file benchmarks/field/requirements.lock
	$(LOCK) --group docs --output-file docs/requirements.lock
	$(LOCK) pyproject.toml --extra study --extra dev --extra bench --resolution lowest-direct --output-file requirements-lowest.lock

# Of the results only what rules make; overlays/ has folders of results with their own.
clean:
	test ! -x $(BIN)/snakemake || $(BIN)/snakemake --delete-all-output
	rm -rf .venv .venv-bench .venv-field .venv-site .venv-lowest .venv-3.12 .venv-3.13 .snakemake report.html site

$(READY): requirements-install.lock requirements.lock pyproject.toml
	@echo "Installing the $(call counted,requirements.lock) packages of requirements.lock into .venv: 0.4 GB, 10 to 60 seconds"
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	@$(call locked,.venv,requirements.lock)
	@$(call ourselves,.venv)
	@touch $(READY)

$(TEST_READY): $(READY) requirements-dev.lock
	@echo "Installing the $(call counted,requirements-dev.lock) packages of requirements-dev.lock, too: 0.4 GB, 10 to 30 seconds"
	@$(call locked,.venv,requirements.lock requirements-dev.lock)
	@touch $(TEST_READY)

$(BENCH_READY): requirements-install.lock requirements.lock requirements-dev.lock benchmarks/requirements.lock pyproject.toml
	test -x $(BENCH_BIN)/python || $(PYTHON) -m venv .venv-bench
	$(call locked,.venv-bench,requirements.lock requirements-dev.lock benchmarks/requirements.lock)
	$(call ourselves,.venv-bench)
	touch $(BENCH_READY)

$(FIELD_READY): requirements-install.lock benchmarks/field/requirements.lock pyproject.toml
	test -x $(FIELD_BIN)/python || $(FIELD_PYTHON) -m venv .venv-field
	$(call locked,.venv-field,benchmarks/field/requirements.lock)
	$(call ourselves,.venv-field)
	touch $(FIELD_READY)

$(SITE_READY): requirements-install.lock docs/requirements.lock
	test -x $(SITE_BIN)/python || $(PYTHON) -m venv .venv-site
	$(call locked,.venv-site,docs/requirements.lock)
	touch $(SITE_READY)
