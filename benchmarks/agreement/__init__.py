"""Whether a diagnosis notices that one of four recordings is of a robot that was changed."""
