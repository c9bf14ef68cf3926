# One command for each thing a maintainer does; `make` alone lists them. README.md and CONTRIBUTING.md say more.

PYTHON := .venv-test/bin/python

help:  ## list these commands
	@sed -n 's/^\([a-z]*\):.*## /\1\t/p' Makefile

$(PYTHON): pyproject.toml constraints.txt
	python3 -m venv .venv-test
	.venv-test/bin/pip install -c constraints.txt -e '.[test,plots,halfspace,surfaces]'
	touch $(PYTHON)

setup: $(PYTHON)  ## make .venv-test with everything that tests, linters and figures need
test: $(PYTHON)  ## run the default tests; TESTS=tests/synth/voice runs a part of them
	$(PYTHON) -m pytest -n 4 --dist loadfile --no-loadscope-reorder -m 'not thorough and not alone' $(TESTS)
	$(PYTHON) -m pytest -m 'alone and not thorough' $(TESTS) || test $$? -eq 5
thorough: $(PYTHON)  ## run more scenes of what the default tests show with a few
	$(PYTHON) -m pytest -n 4 --dist worksteal -m 'thorough and not alone' $(TESTS)
	$(PYTHON) -m pytest -m 'thorough and alone' $(TESTS) || test $$? -eq 5
lint: $(PYTHON)  ## ask every linter
	.ci/lint
bench: $(PYTHON)  ## measure speed; BENCH=voice measures one part
	$(PYTHON) -m tests.bench $(BENCH)
figures: $(PYTHON)  ## draw the figures of the effects, the waveform, live motion and the ready studies again, and the tables of the catalogue
	for figure in waveform effects following catalogue; do $(PYTHON) -m docs.figures.$$figure || exit 1; done
	for study in synth/study/specs/*.json; do \
	  name=$$(basename $$study .json); \
	  $(PYTHON) -m clients study $$name --figure docs/figures/$$name.svg || exit 1; \
	done

.PHONY: help setup test thorough lint bench figures
