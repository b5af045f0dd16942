/// Text on the module's serial line (38,400 baud); in the emulator in the run's event log. On the
/// module each character takes 0.26 ms, for which the call blocks: not for callbacks.
#ifndef __DEBUG_H__
#define __DEBUG_H__  // NOLINT(bugprone-reserved-identifier): programs know it

#ifdef __cplusplus
extern "C" {
#endif

/// A line of text, with its end.
void cprints(const char *text);
/// Text without the end of a line.
void cprints_no_carriage(const char *text);
/// A number, on a line of its own.
void cprinti(int number);

#ifdef __cplusplus
}
#endif

#endif
