"""Keys of an operator: from the terminal or a gamepad, as names that ``Operator`` knows."""
