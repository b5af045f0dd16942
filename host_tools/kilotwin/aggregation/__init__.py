"""The parameter block of `firmware/aggregation`: its tables, and CONFIG. One block among others."""
