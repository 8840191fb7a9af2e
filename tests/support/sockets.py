"""Sockets that a process and its children listen to."""

import socket

import psutil


def listened(pid: int) -> set[tuple[str, str, int]]:
    """Kind, address and port of every socket of IP at which a process or a child of it takes what comes."""
    process, found = psutil.Process(pid), set()
    for each in (process, *process.children(recursive=True)):
        try:
            of_it = each.net_connections("inet")
        except psutil.NoSuchProcess:
            continue
        for one in of_it:
            kind = "tcp" if one.type == socket.SOCK_STREAM else "udp"
            if (kind == "udp" and one.laddr) or one.status == psutil.CONN_LISTEN:
                found.add((kind, one.laddr.ip, one.laddr.port))
    return found
