"""What a log says in numbers: path error, tracking, timing, effort, comparison of two logs."""
