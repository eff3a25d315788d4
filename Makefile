PYTHON ?= python3
BIN := .venv/bin
TEST_ARGS ?=

.PHONY: demo test graphics lint docs bench mutants fuzz clean

demo: .venv/base
	$(BIN)/hecbench demo --out out/demo

test: .venv/dev graphics
	$(BIN)/python -m pytest -n 2 --dist worksteal $(TEST_ARGS)

GRAPHICS := libegl1 libgl1 libgl1-mesa-dri
graphics: # for the pictures of the virtual lab; without them their tests are skipped
	@ldconfig -p | grep -qE 'lib(EGL|OSMesa)\.so' || \
		if [ "$$(id -u)" = 0 ]; then \
			echo "offscreen OpenGL is missing: installing $(GRAPHICS) with apt-get"; \
			apt-get update -qq && apt-get install -y -qq $(GRAPHICS) || true; \
		else echo "offscreen OpenGL is missing: install $(GRAPHICS); until then its tests are skipped"; fi

lint: .venv/dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: .venv/docs
	$(BIN)/mkdocs build --strict --quiet

mutants: .venv/dev
	$(BIN)/python benchmarks/mutants.py $(TEST_ARGS)

fuzz: .venv/dev
	$(BIN)/python benchmarks/fuzz.py $(TEST_ARGS)

bench: .venv/dev
	$(BIN)/python -m pytest benchmarks -p no:xdist --benchmark-only --timeout=0 -s $(TEST_ARGS)

.venv/bin/python:
	$(PYTHON) -m venv .venv || ( \
		$(PYTHON) -m venv --clear --without-pip .venv && \
		$(PYTHON) -m pip --quiet --python $(BIN)/python install pip ) # Debian without python3-venv

.venv/base: .venv/bin/python pyproject.toml constraints.txt
	$(BIN)/pip install --quiet --constraint constraints.txt --editable .
	$(BIN)/hecbench doctor --warm >/dev/null
	touch $@

.venv/dev: .venv/bin/python pyproject.toml constraints.txt
	$(BIN)/pip install --quiet --constraint constraints.txt --editable '.[dev]'
	$(BIN)/hecbench doctor --warm >/dev/null
	touch $@ .venv/base

.venv/docs: .venv/bin/python pyproject.toml constraints.txt
	$(BIN)/pip install --quiet --constraint constraints.txt --editable '.[docs]'
	touch $@

clean:
	rm -rf .venv out build dist site
