# Two commands: `make evaluate` (the main job) and `make test`. Each sets up .venv by itself.

PYTHON ?= python3
VENV := .venv
RUN := $(VENV)/bin/python
PIP := $(RUN) -m pip install --quiet --disable-pip-version-check

.DEFAULT_GOAL := help
.PHONY: help evaluate reproduce play test proofs timing check benchmark docs clean

help:  ## Lists the commands.
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

evaluate: $(VENV)/run.stamp  ## Drives the ten manoeuvres of Table I; results in results/evaluate.
	$(RUN) scripts/evaluate.py $(ARGS)

reproduce: $(VENV)/run.stamp  ## Puts the paper to the test; verdicts and report in results/paper.
	$(RUN) scripts/reproduce_paper.py $(ARGS)

play: $(VENV)/run.stamp  ## Opens the crane in a browser, to be driven by hand.
	$(RUN) scripts/play.py $(ARGS)

test: $(VENV)/dev.stamp check  ## Runs the linters and the tests, or some: ARGS=tests/plant.
	$(RUN) -m pytest -n auto -m "not slow and not timing" $(ARGS)

proofs: $(VENV)/dev.stamp  ## Runs the tests that take longer than a few seconds.
	$(RUN) -m pytest -n auto -m slow $(ARGS)

timing: $(VENV)/dev.stamp  ## Runs the cockpit's proofs by the clock, on a machine that is left alone.
	$(RUN) -m pytest -m timing $(ARGS)

check: $(VENV)/dev.stamp  ## Runs the linters alone.
	$(RUN) -m ruff check .
	$(RUN) -m ruff format --check .
	$(RUN) -m mypy

benchmark: $(VENV)/run.stamp  ## Measures speed, as ratios taken in one run.
	$(RUN) scripts/benchmark.py $(ARGS)

docs: $(VENV)/dev.stamp  ## Builds the documentation with its examples, in docs/build.
	$(RUN) -m sphinx --fail-on-warning --keep-going --quiet --jobs auto docs docs/build

clean:  ## Removes the virtual environment and caches, not the results.
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache .hypothesis build *.egg-info docs/api docs/build docs/gallery

# A stamp appears only after its installation succeeded, so an interrupted one is repeated; and venv
# writes bin/activate last, so without it the environment is begun anew.
$(VENV)/bin/activate:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "OILCrane needs Python 3.11 or newer; set PYTHON=/path/to/python3.11"; exit 1; }
	$(PYTHON) -m venv --clear $(VENV)

$(VENV)/run.stamp: pyproject.toml | $(VENV)/bin/activate
	$(PIP) --editable '.[mpc,results,policies,play]'
	@touch $@

$(VENV)/dev.stamp: pyproject.toml | $(VENV)/bin/activate
	$(PIP) --editable '.[mpc,results,rl,dev]'
	@touch $@ $(VENV)/run.stamp
