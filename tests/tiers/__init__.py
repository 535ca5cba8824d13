"""Which tests run when, and what each of them costs."""
