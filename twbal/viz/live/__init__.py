"""A drive as it happens, shown by Rerun in a process of its own, so that who draws never delays who drives."""
