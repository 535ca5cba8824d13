"""What a file of a recording may be, for faults and help."""

KNOWN = (
    "a CSV of midlines (t, frame, point, x_m, y_m), a SLEAP CSV (frame_idx, <keypoint>.x, "
    "<keypoint>.y) or analysis HDF5, a DeepLabCut CSV or HDF5, a WCON (JSON), an .npz or MATLAB "
    ".mat (points or angles_rad or x and y, with rate_hz; or skeletons) or an .npy of joint angles "
    "(frames, joints)"
)
