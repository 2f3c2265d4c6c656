"""Damaged and random inputs for every reader: each is read, or refused by an error of our own."""
