int other_count(void);
