"""The viewer in a web page: rendercanvas' HTTP canvas behind a guard."""
