"""Hidden robots that are driven by policies that were learned for standing, and are not learned again."""
