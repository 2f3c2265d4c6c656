"""Control languages: each splits a program into blocks of ISO 6983 words."""
