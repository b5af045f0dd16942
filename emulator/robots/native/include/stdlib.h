/// stdlib.h of avr-libc, and no more: a program is free to use other names of the PC's.
#ifndef KILOTWIN_GUEST_STDLIB_H
#define KILOTWIN_GUEST_STDLIB_H

#include <stddef.h>

#define RAND_MAX 0x7FFF
#define RANDOM_MAX 0x7FFFFFFF
#define EXIT_SUCCESS 0
#define EXIT_FAILURE 1
#define DTOSTR_ALWAYS_SIGN 0x01
#define DTOSTR_PLUS_SIGN 0x02
#define DTOSTR_UPPERCASE 0x04

typedef struct {
    int quot, rem;
} div_t;

typedef struct {
    long quot, rem;
} ldiv_t;

typedef int (*__compar_fn_t)(const void *, const void *);

int rand(void);
void srand(unsigned int seed);
int rand_r(unsigned int *state);
long random(void);
void srandom(unsigned int seed);
long random_r(unsigned long *state);

/// A heap as large as the robot's 2 KB leave room for; NULL when it is full.
void *malloc(size_t bytes);
void *calloc(size_t count, size_t size);
void *realloc(void *memory, size_t bytes);
void free(void *memory);

/// Tuning variables of avr-libc; no effect here.
extern size_t __malloc_margin;
extern char *__malloc_heap_start, *__malloc_heap_end;

int abs(int number);
long labs(long number);
div_t div(int dividend, int divisor) __attribute__((const));
ldiv_t ldiv(long dividend, long divisor) __attribute__((const));
void qsort(void *base, size_t count, size_t size, __compar_fn_t compare);
void *bsearch(const void *key, const void *base, size_t count, size_t size, __compar_fn_t compare);

int atoi(const char *text);
long atol(const char *text);
double atof(const char *text);
double strtod(const char *text, char **end);
long strtol(const char *text, char **end, int base);
unsigned long strtoul(const char *text, char **end, int base);

/// Numbers in base 2 to 36, in lower case; a minus sign in base 10 only. They return `text`, which
/// is empty for other bases. A negative number in another base is shown with the bits of the
/// robot's type: 16 for int, 32 for long.
char *itoa(int number, char *text, int base);
char *utoa(unsigned int number, char *text, int base);
char *ltoa(long number, char *text, int base);
char *ultoa(unsigned long number, char *text, int base);

/// As "%<width>.<digits>f"; a negative width aligns to the left.
char *dtostrf(double number, signed char width, unsigned char digits, char *text);
/// As "%.<digits>e".
char *dtostre(double number, char *text, unsigned char digits, unsigned char flags);

/// Stops the robot, as a crash does.
void exit(int status) __attribute__((noreturn));
void abort(void) __attribute__((noreturn));

#endif
