# Without ROS, make demo and make test install wheels of ROS 2 Jazzy into .venv; with ROS sourced
# they use its rclpy. With ROS=kilted they install those of Kilted into .venv-kilted.
ROS =
PYTHON_IN_VENV := .venv$(addprefix -,$(filter-out jazzy,$(ROS)))/bin/python
TESTS ?= test

SECONDS ?= 60
# Each of the many processes of the tests would compile each module again.
export PYTHONDONTWRITEBYTECODE =
# Arguments of tools/bench, such as '--repeat 3 enable'.
BENCH ?=

.PHONY: help demo test check lint unit coverage fuzz soak bench pictures doc-tables clean environment

help:
	@echo 'make demo    run a simulated light and a camera with their nodes, and show what they do'
	@echo 'make test    run all checks and tests; with ROS=kilted on ROS 2 Kilted instead of Jazzy'
	@echo 'make unit    run the tests that need no ROS'
	@echo 'make coverage  measure the branches of the core that its tests run'
	@echo 'make check   run ruff and mypy'
	@echo 'make lint    run ruff, mypy and the linters of ROS'
	@echo 'make fuzz    send hostile input to both sides of the link for SECONDS=60'
	@echo 'make soak    run simulator and bridge with random faults for SECONDS=60'
	@echo 'make bench   measure each target beside its peers, 13 minutes; options in BENCH'
	@echo 'make pictures  draw the pictures of the documentation again, half a minute'
	@echo 'make doc-tables  write the tables of the documentation that the code knows'
	@echo 'make environment  install the packages that the tests need'
	@echo 'make clean   remove .venv, .venv-kilted and all build files'

environment:
	@python3 tools/environment.py test $(ROS)

demo:
	@python3 tools/environment.py demo $(ROS)
	@$(PYTHON_IN_VENV) -m tools.demo

# The types of rclpy differ: mypy checks with those of Jazzy.
test: $(if $(filter-out jazzy,$(ROS)),environment,check)
	@$(PYTHON_IN_VENV) -m pytest -n 4 --dist loadfile --no-loadscope-reorder $(TESTS)

unit: environment
	@$(PYTHON_IN_VENV) -m pytest -p support.no_ros test/mavlink test/transport test/geometry test/payload \
		test/illuminator test/rededge test/gimbal test/payloads test/simulator \
		test/conformance test/cli test/test_bounds.py test/docs/test_links.py test/docs/test_tool_pages.py \
		test/docs/test_payload_pages.py test/docs/test_tables.py \
		test/docs/test_example_pages.py

coverage: environment
	@$(PYTHON_IN_VENV) -m pytest -q -n 2 -p support.no_ros --cov --cov-report=term-missing:skip-covered \
		test/geometry test/payload test/illuminator test/gimbal

check: environment
	@$(PYTHON_IN_VENV) -m ruff check .
	@$(PYTHON_IN_VENV) -m mypy

lint: check
	@$(PYTHON_IN_VENV) -m pytest -q test/lint

fuzz: environment
	@$(PYTHON_IN_VENV) test/fuzz/run.py --seconds $(SECONDS)

soak: environment
	@$(PYTHON_IN_VENV) test/soak/run.py --seconds $(SECONDS)

bench: environment
	@$(PYTHON_IN_VENV) -m tools.bench $(BENCH)

pictures: environment
	@$(PYTHON_IN_VENV) -m tools.pictures

doc-tables: environment
	@$(PYTHON_IN_VENV) -m tools.doc_tables

clean:
	rm -rf .venv .venv-kilted build install log .pytest_cache .mypy_cache .ruff_cache .hypothesis .coverage
	find [a-z]* -name __pycache__ -prune -exec rm -rf {} +
