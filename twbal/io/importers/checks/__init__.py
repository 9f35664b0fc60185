"""What is wrong with a log, before anything is fitted to it: checks yield doubts with a sentence and a picture each."""
