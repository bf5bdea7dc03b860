"""Support for all other folders: files, kernels, random streams, digests of sources, the choice of GL."""
