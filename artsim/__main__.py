"""The program ``artsim``; ``python -m artsim`` is the same."""


def main() -> None:
    """Run it. Worker processes import this module, too, and want none of the program."""
    from artsim.commands.verbs import main as run

    run()


if __name__ == "__main__":
    main()
