"""How often a held-out trial is read and predicted by evaluate, score and report together."""


def test_a_held_out_trial_is_read_once_and_its_wrench_computed_once(watched_run):
    """While nothing can be fitted, see `watched`."""
    held_out = ("postures_validation", "xyz", "xyz_mirror")
    assert watched_run[1] == {(name, trial): 1 for name in ("read_trial", "dynamics_load") for trial in held_out}
