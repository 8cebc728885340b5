!> Measures every method on the same work and draws speed against accuracy, and accuracy against closeness to
!> the places where methods fail. Without arguments it lists the charts and draws none.
program frb_charts
    use frb_chart_agreement, only: chart_agreement
    use frb_chart_cost, only: chart_cost, chart_speed
    use frb_chart_failure, only: chart_failure
    use frb_chart_heavy_top, only: chart_heavy_top
    use frb_chart_orbits, only: chart_orbits
    use frb_chart_output, only: settings, give_up, say
    use frb_chart_precision, only: chart_work_precision, chart_growth
    use frb_chart_ratios, only: chart_ratios
    use frb_chart_scale, only: chart_scale
    use frb_chart_scenes, only: chart_scenes
    use frb_chart_tangent, only: chart_tangent
    use frb_chart_torque, only: chart_torque
    use frb_chart_torus, only: chart_torus
    use frb_chart_triangle, only: chart_triangle
    use frb_chart_water, only: chart_water
    use frb_kinds, only: has_quad
    use frb_system, only: full_files_are_errors
    implicit none

    character(*), parameter :: names(*) = [character(16) :: 'speed', 'scenes', 'cost', 'work-precision', &
        'heavy-top', 'ratios', 'torque', 'failure', 'growth', 'triangle', 'scale', 'water', 'orbits', &
        'tangent', 'agreement']
    type(settings) :: options
    logical :: wanted(size(names))
    integer :: i

    call full_files_are_errors()
    call read_command()
    if (.not. any(wanted)) then
        call list_charts()
        stop
    end if
    if (.not. has_quad) call give_up('the truth needs a compiler with quadruple precision')
    call make_folder()
    do i = 1, size(names)
        if (.not. wanted(i)) cycle
        call say(trim(names(i)))
        select case (names(i))
        case ('speed')
            call chart_speed(options)
        case ('scenes')
            call chart_scenes(options)
        case ('cost')
            call chart_cost(options)
        case ('work-precision')
            call chart_work_precision(options)
        case ('heavy-top')
            call chart_heavy_top(options)
        case ('ratios')
            call chart_ratios(options)
        case ('torque')
            call chart_torque(options)
        case ('failure')
            call chart_failure(options)
        case ('growth')
            call chart_growth(options)
        case ('triangle')
            call chart_triangle(options)
        case ('scale')
            call chart_scale(options)
        case ('tangent')
            call chart_tangent(options)
        case ('water')
            call chart_water(options)
        case ('orbits')
            call chart_orbits(options)
            call chart_torus(options)
        case ('agreement')
            call chart_agreement(options)
        case default
            error stop 'a chart is named that is not drawn'
        end select
    end do

contains

    !> Reads the options and the charts that are wanted.
    subroutine read_command()
        character(:), allocatable :: argument
        integer :: place, which

        wanted = .false.
        options%folder = 'charts'
        place = 1
        do while (place <= command_argument_count())
            argument = argument_at(place)
            select case (argument)
            case ('--quick')
                options%quick = .true.
            case ('--out')
                place = place + 1
                options%folder = argument_at(place)
                if (len(options%folder) == 0) call give_up('--out needs a folder')
            case ('--help', '-h')
                call list_charts()
                stop
            case ('all')
                where (names /= 'agreement') wanted = .true.
            case default
                which = findloc(names == argument, .true., dim=1)
                if (which == 0) call give_up('no such chart: '//argument)
                wanted(which) = .true.
            end select
            place = place + 1
        end do
    end subroutine read_command

    !> Makes the folder of tables and pictures, and looks whether progress can be shown.
    subroutine make_folder()
        integer :: code, command_code

        if (index(options%folder, "'") > 0) call give_up('a quote in the name of the folder')
        call execute_command_line('mkdir -p '''//options%folder//'''', exitstat=code, cmdstat=command_code)
        if (code /= 0) call give_up('cannot make the folder '//options%folder)
        call execute_command_line('test -t 2', exitstat=code, cmdstat=command_code)
        options%terminal = code == 0
    end subroutine make_folder

    !> The argument at this place, '' past the end.
    function argument_at(place) result(text)
        integer, intent(in) :: place
        character(:), allocatable :: text
        integer :: length

        call get_command_argument(place, length=length)
        allocate (character(length) :: text)
        if (length > 0) call get_command_argument(place, text)
    end function argument_at

    !> The text without arguments and of --help.
    subroutine list_charts()
        call say('usage: fpm run frb_charts --profile release -- [WHAT ...] [--quick] [--out DIR]')
        call say('WHAT: all (all charts but the last), or any of')
        call say('  speed           table: the free flow against discrete Moser-Veselov, ratios of time')
        call say('  scenes          table: which method for which scene')
        call say('  cost            time per step against step size, all methods')
        call say('  work-precision  error at t = 10 against time spent, three bodies')
        call say('  heavy-top       the same with torque, against time and torques; energy over long runs')
        call say('  ratios          table: heavy tops to an error, ratios of time')
        call say('  torque          tables: cost of the splitting loop, the long run, runs there and back')
        call say('  failure         error against closeness to every place where methods fail')
        call say('  growth          error against the number of steps for the same time')
        call say('  triangle        error of one step h = 1 over all shapes of a body')
        call say('  scale           time per body against the number of bodies')
        call say('  tangent         error of the derivative of a step against closeness to these places')
        call say('  water           energy of rigid water molecules: schemes, exact rotation and NO_SQUISH')
        call say('  orbits          polhodes, the tennis racket, the torus of a heavy top')
        call say('  agreement       check: measures cost twice, counts the ratios that agree within 15 %')
        call say('--quick: a minute for all of them; --out DIR: where the tables, scripts and '// &
            'pictures go (charts)')
    end subroutine list_charts

end program frb_charts
