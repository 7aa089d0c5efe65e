"""Links behind their drives' dead zones, moved in compiled code.

link_motion    one link: its mesh, a step, a trial
link_streams   all links of a robot, and the column that carries them, sample by sample
balance        forces of all of them in one step
"""
