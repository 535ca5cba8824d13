"""Several animals in one film: blobs of each frame, their identities, one capture for each."""
