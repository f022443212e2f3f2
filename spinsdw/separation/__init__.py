"""What the E/B separation is made of: skies to work on, energy shares, and one file per method."""
