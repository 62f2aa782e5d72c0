"""``python -m evifuse`` is the command line."""

from evifuse.app.main import main

if __name__ == "__main__":
    main()
