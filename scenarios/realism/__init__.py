"""How robots of a scenario compare with recordings of a real one."""
