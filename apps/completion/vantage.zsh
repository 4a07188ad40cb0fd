#compdef vantage
# Completion of `vantage` for zsh: source <(vantage completion zsh)
# It knows no job and no option: each program is asked (`vantage JOB __complete`) what can follow it.

# Offers what a value ("file", "{a,b}", ...) can be.
_vantage_values() {
  local value=$1
  case $value in
    file) _files ;;
    dir) _files -/ ;;
    plugin) compadd -- ${(f)"$($program plugins list --names 2>/dev/null)"} ;;
    '{'*'}') compadd -- ${(s:,:)${${value#\{}%\}}} ;;
    *) _message 'value' ;;
  esac
}

_vantage() {
  local program=${(Q)words[1]} job table
  program=${program/#\~/$HOME}
  if ((CURRENT > 2)); then
    job=${(Q)words[2]}
    table=$($program $job __complete 2>/dev/null)
  else
    table=$($program __complete 2>/dev/null)
  fi
  if [[ -z $table ]]; then
    _files
    return
  fi

  # By name: what of the subcommand at hand takes which value.
  local -A values
  local -a options arguments commands fields
  local scope=. last_many=one line name
  _vantage_scope() {
    scope=$1 last_many=one
    values=() options=() arguments=() commands=()
    for line in ${(f)table}; do
      fields=("${(@ps:\t:)line}")
      [[ $fields[1] == $scope ]] || continue
      case $fields[2] in
        command) commands+=("$fields[3]:${fields[6]//:/\\:}") ;;
        argument) arguments+=("$fields[4]"); last_many=$fields[5] ;;
        *)
          for name in ${(s:,:)fields[3]}; do
            options+=("$name:${fields[6]//:/\\:}")
            values[$name]=$fields[4]
          done ;;
      esac
    done
  }
  _vantage_scope .

  local pending=none word
  integer given=0
  for word in ${words[3,CURRENT-1]}; do
    if [[ $pending != none ]]; then
      pending=none
    elif [[ $word == --*=* ]]; then
      continue
    elif [[ $word == -* ]]; then
      pending=${values[$word]:-none}
    elif (( ${commands[(I)$word:*]} )); then
      _vantage_scope $word
      given=0
    else
      (( ++given ))
    fi
  done

  local current=$words[CURRENT]
  if [[ $pending != none ]]; then
    _vantage_values $pending
  elif [[ $current == --*=* ]]; then
    compset -P '*='
    _vantage_values ${values[${current%%=*}]:-none}
  elif [[ $current == -* ]]; then
    _describe -o 'option' options
  elif (( $#commands )); then
    _describe 'job' commands
  elif (( given < $#arguments )); then
    _vantage_values $arguments[given+1]
  elif (( $#arguments )) && [[ $last_many == many ]]; then
    _vantage_values $arguments[-1]
  fi
}

# Called by the shell that has found this file, or read by one that is to know of it.
if [[ $funcstack[1] == _vantage ]]; then
  _vantage "$@"
else
  compdef _vantage vantage
fi
