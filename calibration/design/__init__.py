"""Which postures and motions to record."""
