# `make help` lists the targets. Every target makes or reuses the virtual environment it needs.

PYTHON ?= python3
VENV ?= .venv
OLDEST ?= .venv-oldest
KILTED ?= .venv-kilted
PYTEST_ARGS ?=
ACCURACY_ARGS ?=
BENCH_ARGS ?=
REALITY_ARGS ?=
SERVICE_ARGS ?=
CHURN_ARGS ?=
SOAK_ARGS ?=
LOAD_ARGS ?=
HOSTS_ARGS ?=
MUTANTS_ARGS ?=

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
MAKEFLAGS += --no-print-directory

# Nodes that a demo or a test starts are seen on this machine only.
export ROS_AUTOMATIC_DISCOVERY_RANGE := LOCALHOST
# The wheels hold one middleware; a sourced ROS installation keeps its own choice.
ifndef ROS_DISTRO
export RMW_IMPLEMENTATION := rmw_fastrtps_cpp
endif
# Each of the hundreds of processes that tests start would compile the package anew.
unexport PYTHONDONTWRITEBYTECODE
# Another environment with ROS 2 wheels, if activated, would hand down its own library path.
ifdef _ROS_WHEELS_BOOTSTRAP_COMPLETE
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE
unexport LD_LIBRARY_PATH
endif

INSTALL = "$(PYTHON)" requirements/install.py "$(VENV)"

.PHONY: help
help:  ## list the targets
	@sed -n 's/^\([a-z-]*\):.*##  *\(.*\)/make \1|\2/p' Makefile | while IFS='|' read -r target text; do printf '%-16s %s\n' "$$target" "$$text"; done

.PHONY: demo
demo: $(if $(findstring --dashboard,$(DEMO_ARGS)),venv-dashboard,venv)  ## a simulated valve whose friction grows and is diagnosed, in under two minutes
	@"$(VENV)/bin/valve_friction" demo $(DEMO_ARGS)

.PHONY: test
test: lint  ## lint, then all tests except the long ones; PYTEST_ARGS="-k name" for some
	@"$(VENV)/bin/python" -m pytest -n 2 --dist loadfile -m "not slow" $(PYTEST_ARGS)

.PHONY: test-long
test-long: venv-test  ## the long tests: demos, drawn valves, whole lives of alarms
	@"$(VENV)/bin/python" -m pytest -n 2 --dist loadfile -m slow $(PYTEST_ARGS)

# What depends most on the libraries, in a few minutes: figures, reports, tables, kernels, statistics.
OLDEST_TESTS = $(addprefix test/,test_package.py test_front_door.py model/test_simulation.py \
    model/test_value_types.py test_signals.py identification/test_refusals.py records health/test_diagnosis.py \
    history/test_file.py history/test_trend.py figures test_reports.py nodes/test_start.py)

.PHONY: test-oldest
test-oldest:  ## some tests with the oldest versions that the package declares
	@$(python-found)
	@code=0; "$(PYTHON)" requirements/install.py "$(OLDEST)" oldest || code=$$?; \
	case $$code in \
	0) NUMBA_CACHE_DIR="$(abspath $(OLDEST))/numba" \
	    "$(OLDEST)/bin/python" -m pytest -n 2 --dist loadfile $(PYTEST_ARGS) $(OLDEST_TESTS) ;; \
	3) ;; \
	*) exit $$code ;; \
	esac

# ROS of a sourced installation would come before that of the wheels.
.PHONY: test-kilted
test-kilted:  ## the node tests with ROS 2 Kilted, from wheels
	@$(python-found)
	@"$(PYTHON)" requirements/install.py "$(KILTED)" kilted
	@env -u PYTHONPATH -u AMENT_PREFIX_PATH -u LD_LIBRARY_PATH RMW_IMPLEMENTATION=rmw_fastrtps_cpp \
	    "$(KILTED)/bin/python" -m pytest -n 2 --dist loadfile $(PYTEST_ARGS) test/nodes

.PHONY: lint
lint: venv-test  ## ruff and mypy
	@"$(VENV)/bin/ruff" check
	@"$(VENV)/bin/ruff" format --check
	@"$(VENV)/bin/mypy"

.PHONY: format
format: venv-test  ## reformat the code with ruff, and fix what it can
	@"$(VENV)/bin/ruff" check --fix
	@"$(VENV)/bin/ruff" format

.PHONY: venv
venv:  ## the virtual environment that runs the package
	@$(python-found)
	@$(INSTALL)

.PHONY: venv-dashboard
venv-dashboard:  ## the same, plus what the dashboard needs
	@$(python-found)
	@$(INSTALL) dashboard

.PHONY: venv-database
venv-database:  ## the same, plus what a history on a server needs
	@$(python-found)
	@$(INSTALL) database

.PHONY: venv-cluster
venv-cluster:  ## the same, plus what Dask clusters and object stores need
	@$(python-found)
	@$(INSTALL) cluster

.PHONY: venv-test
venv-test:  ## the same, plus the test tools
	@$(python-found)
	@$(INSTALL) test

.PHONY: browser
browser:  ## Chromium for the tests of pages, by apt-get where root runs make; those tests are skipped without it
	@if command -v chromium >/dev/null; then :; \
	elif [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	    echo "Installing Chromium: once, about a minute ..."; \
	    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive \
	        apt-get install -y -qq --no-install-recommends chromium fonts-dejavu-core >/dev/null; } \
	    || echo "make: tests of pages in a browser are skipped: \`apt-get install chromium\` has failed"; \
	else echo "make: tests of pages in a browser are skipped: run \`apt install chromium\`"; fi

.PHONY: postgres
postgres:  ## PostgreSQL for the tests of a history on a server, by apt-get where root runs make; they are skipped without it
	@if command -v postgres >/dev/null || ls /usr/lib/postgresql/*/bin/postgres >/dev/null 2>&1; then :; \
	elif [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	    echo "Installing PostgreSQL: once, about a minute ..."; \
	    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive \
	        apt-get install -y -qq --no-install-recommends postgresql >/dev/null; } \
	    || echo "make: tests of a history on a server are skipped: \`apt-get install postgresql\` has failed"; \
	else echo "make: tests of a history on a server are skipped: run \`apt install postgresql\`"; fi

.PHONY: docs
docs:  ## the documentation as pages, build/docs/index.html
	@$(python-found)
	@$(INSTALL) docs
	@"$(VENV)/bin/python" -m sphinx --builder html --fail-on-warning --keep-going --quiet doc build/docs
	@echo "build/docs/index.html"

.PHONY: accuracy
accuracy: venv  ## what the estimate reaches, in half an hour; ACCURACY_ARGS="--seeds 3" for less
	@"$(VENV)/bin/python" -m benchmark.accuracy $(ACCURACY_ARGS)

.PHONY: reality
reality: venv  ## the estimate on randomly generated valves and imperfect sensors, in half an hour; REALITY_ARGS=--brief for less
	@OPENBLAS_NUM_THREADS=1 "$(VENV)/bin/python" -m benchmark.reality $(REALITY_ARGS)

.PHONY: service
service: venv  ## evidence from valves in closed-loop service, 1,000 hours and more; SERVICE_ARGS="--brief --hours 40" for less
	@OPENBLAS_NUM_THREADS=1 "$(VENV)/bin/python" -m benchmark.service $(SERVICE_ARGS)

.PHONY: bench
bench: venv  ## what each item costs, compared with its peers; BENCH_ARGS="--parts sweep" for some
	@OPENBLAS_NUM_THREADS=1 "$(VENV)/bin/python" -m benchmark.speed $(BENCH_ARGS)

.PHONY: churn
churn: venv  ## nodes whose clients come and go for an hour; CHURN_ARGS="--minutes 5" for less
	@"$(VENV)/bin/python" -m benchmark.churn $(CHURN_ARGS)

.PHONY: soak
soak: venv  ## a month of a plant in an hour, each sample accounted for; SOAK_ARGS="--minutes 5" for less
	@"$(VENV)/bin/python" -m benchmark.soak $(SOAK_ARGS)

.PHONY: load
load: venv-test browser  ## the dashboard with 500 valves in a real browser, 20 minutes; LOAD_ARGS="--parts bounds" for some
	@"$(VENV)/bin/python" -m benchmark.load $(LOAD_ARGS)

.PHONY: hosts
hosts: venv  ## a plant of five hosts, of which one dies and one is cut off, in network namespaces, as root; HOSTS_ARGS="--valves 100 --server"
	@"$(VENV)/bin/python" -m benchmark.hosts $(HOSTS_ARGS)

.PHONY: mutants
mutants: venv-test  ## mistakes that the tests would not notice, takes hours; MUTANTS_ARGS="--room trust --sample 100" for some
	@"$(VENV)/bin/python" -m pip install -q --no-deps --disable-pip-version-check -r requirements/mutants.txt
	@"$(VENV)/bin/python" -m benchmark.mutants $(MUTANTS_ARGS)

.PHONY: release-check
release-check:  ## what a release still lacks: owner data, notices, versions
	@$(python-found)
	@"$(PYTHON)" .ci/release.py

.PHONY: clean
clean:  ## remove what make and colcon made
	@rm -rf -- "$(VENV)" "$(OLDEST)" "$(KILTED)" build install log .pytest_cache .mypy_cache .ruff_cache .hypothesis *.egg-info
	@find . -name __pycache__ -type d -prune -exec rm -rf -- {} +

define python-found
command -v "$(PYTHON)" >/dev/null || { echo "make: $(PYTHON) is not there: run \`apt install python3 python3-venv\`" >&2; exit 1; }
endef
