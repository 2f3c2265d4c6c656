"""The page on this computer into which a program or part is dropped: server, its workers, and the page."""
