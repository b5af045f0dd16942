/* The struct of debug info that a project for the ARGoS simulator keeps beside its behaviours. No
 * simulator is here to read it. */
#ifdef __cplusplus
extern "C" {
#endif

typedef enum { MSG_T_NORMAL_IR = 0, MSG_T_TEST = 0x0A, MSG_T_BOOT = 0x80 } IR_message_type_t;

typedef struct {
    double drawn_debug;
    uint32_t ticks_debug;
} debug_info_t;

#ifdef __cplusplus
}
#endif
