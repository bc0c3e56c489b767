"""What cases/run and cases/mesh share: the case file, and everything round the three programs."""
