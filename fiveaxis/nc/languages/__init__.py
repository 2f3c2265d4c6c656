"""The languages of controls, each turned into blocks in the words of ISO 6983."""
