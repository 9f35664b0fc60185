def pytest_addoption(parser):
    parser.addoption(
        "--robot",
        metavar="PORT|COMMAND",
        help="try this robot alone: its port, or a program that prints `port <path>`; {clock} in it becomes lockstep "
        "and real_time",
    )
