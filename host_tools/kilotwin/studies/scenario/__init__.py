"""Scenarios: experiments that say by [[expect]] what is to come of them."""
