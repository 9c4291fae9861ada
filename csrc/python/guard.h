// What the GIL protects, where Python has one: there, all of this is nothing. Where it has none
// (Py_GIL_DISABLED), these are locks of the core's own. Each is held for a short time and for no
// call that may run Python code; no thread takes a second one, or waits for a renderer, with it.
#ifndef VKB_GUARD_H
#define VKB_GUARD_H

#ifdef Py_GIL_DISABLED
// A member, or a global with its storage class before it.
#define VKB_GUARD(name)  PyMutex name;
#define VKB_LOCK(name)   PyMutex_Lock(&(name))
#define VKB_UNLOCK(name) PyMutex_Unlock(&(name))
// What threads read and write without one of these.
#define VKB_ATOMIC(type) _Atomic(type)
#else
#define VKB_GUARD(name)
#define VKB_LOCK(name)   ((void)0)
#define VKB_UNLOCK(name) ((void)0)
#define VKB_ATOMIC(type) type
#endif

// To be called once in a process: from then on the guards of a module are free in forked processes.
// (Those of a renderer are not used there: it belongs to its process.)
bool vkb_guards_begin(void);

#ifdef Py_GIL_DISABLED
// Guards the memory of renderers that objects outlive: pages, residents and exports, whose
// functions must not overlap. One for all renderers, since the memory is freed with the last such
// object.
extern PyMutex vkb_memory;
#endif

#endif
