"""Spin scale-discretised wavelets on the sphere."""
