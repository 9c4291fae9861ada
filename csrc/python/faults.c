#ifdef VKBLOOM_FAULTS

#include "vulkan/faults.h"

#include "execute/pipeline.h"
#include "python/module.h"

#include <stdatomic.h>
#include <string.h>

VkResult vkb_fault_result;
static atomic_long remaining, passed, blocks, messages;
static char among[256], failed[256];

bool vkb_fault(const char *call_text)
{
    char name[64] = "";
    size_t length;
    const char *start = vkb_call_name(call_text, &length);

    if (length == 0 || length >= sizeof name)
        return false;
    memcpy(name, start, length);
    if (*among && !strstr(among, name))
        return false;
    atomic_fetch_add(&passed, 1);
    if (atomic_fetch_sub(&remaining, 1) != 1)
        return false;
    memcpy(failed, name, sizeof name);
    return true;
}

void vkb_fault_blocks(int more)
{
    atomic_fetch_add(&blocks, more);
}

void vkb_fault_message(void)
{
    atomic_fetch_add(&messages, 1);
}

PyObject *vkb_fault_arm(PyObject *module, PyObject *arguments)
{
    long n;
    int result;
    const char *names;

    (void)module;
    if (!PyArg_ParseTuple(arguments, "lis:arm_fault", &n, &result, &names))
        return NULL;
    if (strlen(names) >= sizeof among) {
        PyErr_SetString(PyExc_ValueError, "too many names");
        return NULL;
    }
    strcpy(among, names);
    *failed = '\0';
    vkb_fault_result = (VkResult)result;
    atomic_store(&passed, 0);
    atomic_store(&remaining, n);
    Py_RETURN_NONE;
}

PyObject *vkb_fault_state(PyObject *module, PyObject *unused)
{
    (void)module;
    (void)unused;
    return Py_BuildValue("(lsll)", atomic_load(&passed), failed, atomic_load(&blocks),
                         atomic_load(&messages));
}

PyObject *vkb_fault_fold(PyObject *module, PyObject *by_driver)
{
    const int value = PyObject_IsTrue(by_driver);

    (void)module;
    if (value < 0)
        return NULL;
    vkb_driver_folds = value;
    Py_RETURN_NONE;
}

PyObject *vkb_fault_forget(PyObject *module, PyObject *unused)
{
    (void)module;
    (void)unused;
    vkb_fault_forget_instances();
    Py_RETURN_NONE;
}

#else

// ISO C wants something in every file.
typedef int vkb_no_faults;

#endif
