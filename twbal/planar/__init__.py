"""The analytic twin: a robot that only drives straight ahead, by its equations of motion."""
