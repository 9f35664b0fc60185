"""What a log looks like before anything is fitted to it: each check yields doubts, each with a sentence and a picture."""
