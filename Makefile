PYTHON ?= python3
BIN := .venv/bin
TEST_ARGS ?=

.PHONY: demo test lint bench clean

demo: .venv/base
	$(BIN)/hecbench demo --out out/demo

test: .venv/dev
	$(BIN)/python -m pytest -n 2 --dist worksteal $(TEST_ARGS)

lint: .venv/dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: .venv/dev
	$(BIN)/python -m pytest benchmarks -p no:xdist --benchmark-only --timeout=0 -s $(TEST_ARGS)

.venv/bin/python:
	$(PYTHON) -m venv .venv || ( \
		$(PYTHON) -m venv --clear --without-pip .venv && \
		$(PYTHON) -m pip --quiet --python $(BIN)/python install pip ) # Debian without python3-venv

.venv/base: .venv/bin/python pyproject.toml constraints.txt
	$(BIN)/pip install --quiet --constraint constraints.txt --editable .
	touch $@

.venv/dev: .venv/bin/python pyproject.toml constraints.txt
	$(BIN)/pip install --quiet --constraint constraints.txt --editable '.[dev]'
	touch $@ .venv/base

clean:
	rm -rf .venv out build dist
