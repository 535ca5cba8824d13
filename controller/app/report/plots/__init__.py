"""Pictures that commands draw, one file a command."""
