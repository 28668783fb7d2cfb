"""The paper's numbers beside those found here."""
