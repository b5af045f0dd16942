/// Orders of the host to a module that has the published library's traits (traits.h). Pure.
#ifndef MODULE_CORE_ORIGINAL_ORDERS_H
#define MODULE_CORE_ORIGINAL_ORDERS_H

#include "orders.h"

#ifdef __cplusplus
extern "C" {
#endif

/// orders_receive() of such a module: same arguments, result and cost.
order_t original_receive(orders_t *orders, const uint8_t *data, uint8_t length, bool remote);

#ifdef __cplusplus
}
#endif

#endif
