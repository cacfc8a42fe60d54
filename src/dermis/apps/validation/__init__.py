"""How wrong and how fast the package is: accuracy, peers, engines, comparisons and benchmarks."""
