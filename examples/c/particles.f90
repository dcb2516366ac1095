! A particle loop of your own around a compiled obstacle, in Fortran 2003: a thousand balls fall on a pawn. The module
! declares the functions of rfm.h that the loop needs; src/bindings/c/tests/run compiles and runs it where gfortran is.

module rfm
  use, intrinsic :: iso_c_binding
  implicit none

  ! arrays by the addresses of their first numbers and the distance between two numbers, bytes
  type, bind(c) :: rfm_points
    type(c_ptr) :: x, y, z
    integer(c_intptr_t) :: stride
  end type
  type, bind(c) :: rfm_vectors
    type(c_ptr) :: x, y, z
    integer(c_intptr_t) :: stride
  end type
  type, bind(c) :: rfm_values
    type(c_ptr) :: values
    integer(c_intptr_t) :: stride
  end type
  type, bind(c) :: rfm_collisions
    integer(c_size_t) :: hits, stuck, undefined
  end type
  type, bind(c) :: rfm_param
    type(c_ptr) :: name
    real(c_double) :: value
  end type

  interface
    integer(c_int) function rfm_load_file(path, params, count, program, error) bind(c)
      import
      character(kind=c_char), intent(in) :: path(*)
      type(rfm_param), intent(in) :: params(*)
      integer(c_size_t), value :: count
      type(c_ptr), intent(out) :: program, error
    end function
    integer(c_int) function rfm_solid(program, name, solid, error) bind(c)
      import
      type(c_ptr), value :: program
      character(kind=c_char), intent(in) :: name(*)
      type(c_ptr), intent(out) :: solid, error
    end function
    integer(c_int) function rfm_omega_many(solid, count, points, omega, error) bind(c)
      import
      type(c_ptr), value :: solid
      integer(c_size_t), value :: count
      type(rfm_points), value :: points
      type(rfm_values), value :: omega
      type(c_ptr), intent(out) :: error
    end function
    integer(c_int) function rfm_collide(solid, count, positions, velocities, restitution, friction, reach, &
                                        collisions, error) bind(c)
      import
      type(c_ptr), value :: solid
      integer(c_size_t), value :: count
      type(rfm_vectors), value :: positions, velocities
      real(c_double), value :: restitution, friction, reach
      type(rfm_collisions), intent(out) :: collisions
      type(c_ptr), intent(out) :: error
    end function
    type(c_ptr) function rfm_error_message(error) bind(c)
      import
      type(c_ptr), value :: error
    end function
    subroutine rfm_error_free(error) bind(c)
      import
      type(c_ptr), value :: error
    end subroutine
    subroutine rfm_program_free(program) bind(c)
      import
      type(c_ptr), value :: program
    end subroutine
    subroutine rfm_solid_free(solid) bind(c)
      import
      type(c_ptr), value :: solid
    end subroutine
    integer(c_size_t) function strlen(text) bind(c)
      import
      type(c_ptr), value :: text
    end function
  end interface

contains

  ! ends the program with the message of an error
  subroutine check(status, error)
    integer(c_int), intent(in) :: status
    type(c_ptr), intent(in) :: error
    character(kind=c_char), pointer :: letters(:)
    type(c_ptr) :: text
    if (status == 0) return
    text = rfm_error_message(error)
    call c_f_pointer(text, letters, [strlen(text)])
    print '(*(a))', letters
    call rfm_error_free(error)
    stop 1
  end subroutine
end module

program particles
  use rfm
  implicit none

  integer, parameter :: count = 1000
  real(c_double), parameter :: dt = 0.001_c_double
  ! a column of x, one of y and one of z
  real(c_double), target :: x(count, 3), v(count, 3), omega(count)
  character(kind=c_char), target :: cx(3) = ['c', 'x', c_null_char]
  character(len=256) :: path
  type(c_ptr) :: file, pawn, error
  type(rfm_param) :: params(1)
  type(rfm_points) :: points
  type(rfm_vectors) :: places, velocities
  type(rfm_collisions) :: found
  integer(c_size_t) :: hits
  integer(c_int) :: status
  integer(c_intptr_t), parameter :: stride = 8
  integer :: i, step, inside

  path = 'examples/pawn.rfm'
  if (command_argument_count() > 0) call get_command_argument(1, path)
  params(1) = rfm_param(c_loc(cx), 1.25_c_double)
  status = rfm_load_file(trim(path)//c_null_char, params, 1_c_size_t, file, error)
  call check(status, error)
  status = rfm_solid(file, 'pawn'//c_null_char, pawn, error)
  call check(status, error)
  call rfm_program_free(file)

  do i = 1, count
    x(i, 1) = 0.75 + mod(i - 1, 10)/10.0_c_double
    x(i, 2) = 1.0 + mod((i - 1)/10, 10)/10.0_c_double
    x(i, 3) = 1.6 + (i - 1)/100/10.0_c_double
  end do
  v = 0
  hits = 0
  points = rfm_points(c_loc(x(1, 1)), c_loc(x(1, 2)), c_loc(x(1, 3)), stride)
  places = rfm_vectors(c_loc(x(1, 1)), c_loc(x(1, 2)), c_loc(x(1, 3)), stride)
  velocities = rfm_vectors(c_loc(v(1, 1)), c_loc(v(1, 2)), c_loc(v(1, 3)), stride)

  do step = 1, 1000
    v(:, 3) = v(:, 3) - 9.81*dt
    x = x + dt*v
    x(:, 3) = max(x(:, 3), 0.0_c_double)
    status = rfm_collide(pawn, int(count, c_size_t), places, velocities, 0.5_c_double, 0.0_c_double, &
                         0.5_c_double, found, error)
    call check(status, error)
    hits = hits + found%hits
  end do

  status = rfm_omega_many(pawn, int(count, c_size_t), points, rfm_values(c_loc(omega), stride), error)
  call check(status, error)
  inside = sum(merge(1, 0, omega > 0))
  if (hits > 1000) then
    print '(a, i0, a, i0, a)', 'many hits, ', inside, ' of ', count, ' particles inside the pawn'
  else
    print '(a)', 'few hits'
  end if
  call rfm_solid_free(pawn)
end program
