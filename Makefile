# Any Python 3 starts tests/run.py, which finds the interpreters that the tests need.
# A name on PATH may be a version manager's shim that cannot run: try each.
PYTHON ?= $(shell for p in python3 python3.13 python3.11 python $(HOME)/.pyenv/versions/3.*/bin/python3; do \
	"$$p" -c 'import sys; sys.exit(sys.version_info < (3, 8))' >/dev/null 2>&1 && { echo "$$p"; break; }; done)

.PHONY: test test-window zip demo bench report stability lint clean

test:
	@$(PYTHON) tests/run.py test

test-window:
	@$(PYTHON) tests/run.py test-window

zip:
	@$(PYTHON) tests/run.py zip

demo:
	@$(PYTHON) tests/run.py demo

bench:
	@$(PYTHON) tests/run.py bench

report:
	@$(PYTHON) tests/run.py report

stability:
	@$(PYTHON) tests/run.py stability

lint:
	@$(PYTHON) tests/run.py lint

clean:
	rm -rf build
