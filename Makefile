# Every verb works in a fresh checkout: it builds .venv, installs what it needs and runs.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OLDEST := $(shell sed -n 's/^python_requires = >=//p' setup.cfg)

.DEFAULT_GOAL := help
.PHONY: help run test slow coverage lint format types docs tutorials bench clean

help:
	@echo "make run        separate the bundled WMAP synchrotron map into E and B, in output/wmap/"
	@echo "make test       run the tests that take seconds"
	@echo "make slow       run the tests that take longer"
	@echo "make coverage   run the tests without compilation and say which lines they missed"
	@echo "make lint       check style and format"
	@echo "make format     mend style and format"
	@echo "make types      check the type hints"
	@echo "make docs       build the documentation in docs/_build/html"
	@echo "make tutorials  run every tutorial"
	@echo "make bench      run the smallest benchmark"
	@echo "make clean      remove everything that make built"

run: $(VENV)/.installed-plot
	@$(BIN)/spinsdw demo --output output/wmap --overwrite

test: $(VENV)/.installed-test
	@$(BIN)/python -m pytest -q

slow: $(VENV)/.installed-test
	@$(BIN)/python -m pytest -q -m slow

coverage: $(VENV)/.installed-test
	@NUMBA_DISABLE_JIT=1 $(BIN)/python -m coverage run -m pytest -q
	@$(BIN)/python -m coverage report --skip-covered --show-missing

lint: $(VENV)/.installed-test
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .

format: $(VENV)/.installed-test
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

types: $(VENV)/.installed-test
	@$(BIN)/mypy

docs: $(VENV)/.installed-docs
	@$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo "The documentation is in docs/_build/html/index.html."

tutorials: $(VENV)/.installed-test
	@$(BIN)/python -m pytest -q -m "slow or not slow" tests/test_tutorials.py

bench: $(VENV)/.installed-test
	@$(BIN)/python benchmarks/smoke.py
	@$(BIN)/python -m benchmarks.purity --setting tiny --surveys B --folder build/purity

clean:
	rm -rf $(VENV) build dist output *.egg-info docs/_build docs/generated docs/gallery \
		docs/sg_execution_times.rst .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# One marker per extra: pip runs again only when a file that says what to install has changed.
$(VENV)/.installed-%: setup.cfg pyproject.toml | $(BIN)/python
	@echo "Installing spinsdw[$*] into $(VENV) ..."
	@$(BIN)/python -m pip install --quiet --quiet --disable-pip-version-check --editable '.[$*]'
	@touch $@

$(BIN)/python:
	@command -v $(PYTHON) >/dev/null || { \
		echo "$(PYTHON) was not found; install Python $(OLDEST) or newer, or name one: make PYTHON=/path/to/python3." >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info[:2] < tuple(map(int, "$(OLDEST)".split("."))))' || { \
		echo "$(PYTHON) is $$($(PYTHON) -V 2>&1) and spinsdw needs $(OLDEST) or newer; name a newer one: make PYTHON=/path/to/python3." >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
		echo "$(PYTHON) cannot make virtual environments; install its venv package (on Debian and Ubuntu: apt install python3-venv)." >&2; exit 1; }
	@$(PYTHON) -m venv --clear $(VENV)
