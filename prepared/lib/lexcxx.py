"""Splits C++ text into code, string literals and comments; shared by rename.py, words.py and the scripts that made the tables."""
import re

TOKEN = re.compile(
    r'''(?P<comment>//(?:[^\n\\]|\\.|\\\n)*|/\*.*?\*/)'''
    r'''|(?P<raw>(?:u8|u|U|L)?R"(?P<delim>[^()\\\s]{0,16})\(.*?\)(?P=delim)")'''
    r'''|(?P<include>^[ \t]*\#[ \t]*include[ \t]*[<"][^>"\n]*[>"])'''
    r'''|(?P<string>(?:u8|u|U|L)?"(?:[^"\\\n]|\\.|\\\n)*")'''
    r'''|(?P<number>(?<![A-Za-z0-9_])\d(?:[0-9A-Za-z_.]|'[0-9A-Za-z_]|[eEpP][+-])*)'''
    r'''|(?P<char>'(?:[^'\\\n]|\\.)+')'''
    r'''|(?P<word>[A-Za-z_][A-Za-z0-9_]*)''',
    re.S | re.M)
WORD = re.compile(r'[A-Za-z_][A-Za-z0-9_]*')
CXX = ('.cpp', '.hpp', '.c', '.h', '.hpp.in')


def pieces(text):
    """(kind, start, end): kind is comment, raw, include, string, number, char, word; what lies between is punctuation."""
    for m in TOKEN.finditer(text):
        yield m.lastgroup if m.lastgroup != 'delim' else 'raw', m.start(), m.end()


def kind_of(m):
    for k in ('comment', 'raw', 'include', 'string', 'number', 'char', 'word'):
        if m.group(k) is not None:
            return k
