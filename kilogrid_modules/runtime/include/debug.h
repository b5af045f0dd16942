/// Text on the module's serial line; in the emulator in the run's event log.
#ifndef __DEBUG_H__
#define __DEBUG_H__  // NOLINT(bugprone-reserved-identifier): programs know it

#ifdef __cplusplus
extern "C" {
#endif

/// A line of text.
void cprints(const char *text);
void cprints_no_carriage(const char *text);
/// A number, on a line of its own.
void cprinti(int number);

#ifdef __cplusplus
}
#endif

#endif
