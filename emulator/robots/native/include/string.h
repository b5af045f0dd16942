/// string.h of avr-libc, and no more: a program is free to use other names of the PC's.
#ifndef KT_STRING_H
#define KT_STRING_H

#include <stddef.h>

void *memccpy(void *to, const void *from, int stop, size_t bytes);
void *memchr(const void *memory, int byte, size_t bytes);
int memcmp(const void *a, const void *b, size_t bytes);
void *memcpy(void *to, const void *from, size_t bytes);
void *memmem(const void *memory, size_t bytes, const void *part, size_t part_bytes);
void *memmove(void *to, const void *from, size_t bytes);
void *memrchr(const void *memory, int byte, size_t bytes);
void *memset(void *memory, int byte, size_t bytes);

int strcasecmp(const char *a, const char *b);
char *strcasestr(const char *text, const char *part);
char *strcat(char *to, const char *from);
char *strchr(const char *text, int character);
char *strchrnul(const char *text, int character);
int strcmp(const char *a, const char *b);
int strcoll(const char *a, const char *b);
char *strcpy(char *to, const char *from);
size_t strcspn(const char *text, const char *stop);
char *strdup(const char *text);
char *strerror(int number);
size_t strlcat(char *to, const char *from, size_t bytes);
size_t strlcpy(char *to, const char *from, size_t bytes);
size_t strlen(const char *text);
char *strlwr(char *text);
int strncasecmp(const char *a, const char *b, size_t bytes);
char *strncat(char *to, const char *from, size_t bytes);
int strncmp(const char *a, const char *b, size_t bytes);
char *strncpy(char *to, const char *from, size_t bytes);
size_t strnlen(const char *text, size_t bytes);
char *strpbrk(const char *text, const char *stop);
char *strrchr(const char *text, int character);
char *strrev(char *text);
char *strsep(char **text, const char *stop);
size_t strspn(const char *text, const char *accepted);
char *strstr(const char *text, const char *part);
char *strtok(char *text, const char *stop);
char *strtok_r(char *text, const char *stop, char **rest);
char *strupr(char *text);

int ffs(int number);
int ffsl(long number);
int ffsll(long long number);

#endif
