"""The commands of the command line, each in the file that is named for it."""
