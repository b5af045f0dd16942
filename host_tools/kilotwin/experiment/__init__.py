"""What an experiment file means: schema, checks, profiles, and what the engine gets."""
