"""Pages that tell what a run came to; the only folder that knows jinja2."""
